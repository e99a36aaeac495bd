//! Lab readings. They are matched to a recipe's pattern, converted to BRDFs, checked for outliers, and fitted.
//!
//! A row of a file is a [`LabReading`], a sample of a recipe with all its readings a [`SampleReading`], and its mapped value
//! for the posterior a [`PosteriorReading`](crate::linear::PosteriorReading).

mod angles;
mod bands;
mod fit;
mod gaps;
mod instrument;
mod layout;
mod loss_scale;
mod next;
mod noise;
mod outliers;
mod placement;
mod quantity;
mod readings;
mod recipe;
mod report;
mod rows;
mod spectrum;
mod table;

pub use angles::{
    AngleArgs, AngleConvention, AngleRow, AngleTable, angles_from_vectors, rusinkiewicz,
};
pub use fit::{FitFailure, MaterialFit, Selection};
pub use gaps::{Gaps, GlossGap};
pub use instrument::Instrument;
pub use layout::AngleUnit;
pub use loss_scale::LossScale;
pub use next::NextReading;
pub use noise::{NoiseSource, NoiseSummary};
pub use outliers::Outliers;
pub use placement::AngularDistance;
pub use quantity::{CountCalibration, LargerSpot, Multiple, ReadingQuantity};
pub use readings::{ReadingStatus, Readings, SampleReading};
pub use recipe::NamedRecipe;
pub use report::{FitReport, MaterialFiles, material_files};
pub use rows::{LabReading, ReadingRows};
pub use spectrum::{SpectrumReading, SpectrumReport};
pub use table::TableError;
