//! Lab readings. They are matched to a recipe's pattern, converted to BRDFs, checked for outliers, and fitted.

mod angles;
mod any_directions;
mod bands;
mod convention;
mod fit;
mod instrument;
mod layout;
mod matched_rows;
mod matching;
mod measurements;
mod next;
mod outliers;
mod quantity;
mod reading_row;
mod rows;
mod table;

pub use angles::{AngleRow, AngleTable, angles_from_vectors};
pub use any_directions::{ChosenRecipe, NamedRecipe};
pub use convention::{AngleArgs, AngleConvention, AngleUnit};
pub use fit::{Fit, FitFailure, MaterialFiles, ReadingStatus, Selection, fit, material_files};
pub use instrument::Instrument;
pub use matching::{AngularDistance, IsotropicAngles};
pub use measurements::{Measurements, coefficient_of_variation};
pub use next::MachineArgs;
pub use outliers::OutlierReport;
pub use quantity::{
    CountCalibration, FOOTPRINTS, Multiple, QUANTITIES, ReadingQuantity, WhiteReference,
};
pub use reading_row::LabReading;
pub use rows::Rows;
pub use table::TableError;
