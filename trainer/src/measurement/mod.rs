//! Lab readings. They are matched to a recipe's pattern, converted to BRDFs, checked for outliers, and fitted.

mod angles;
mod fit;
mod matching;
mod measurements;
mod outliers;
mod quantity;
mod reading_row;
mod rows;
mod table;

pub use angles::{AngleRow, AngleTable, angles_from_vectors};
pub use fit::{
    Fit, FitFailure, MaterialFiles, PartialScan, ReadingStatus, Selection, fit, material_files,
};
pub use matching::{AngularDistance, IsotropicAngles};
pub use measurements::{DEFAULT_TOLERANCE, Measurements, coefficient_of_variation};
pub use outliers::{
    Distribution, MAX_SAMPLES, Outlier, OutlierReport, Prediction, outlier_threshold,
};
pub use quantity::{CountCalibration, FOOTPRINTS, QUANTITIES, ReadingQuantity, WhiteReference};
pub use rows::LabReading;
pub use table::TableError;
