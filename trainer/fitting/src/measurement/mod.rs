//! Lab readings. They are matched to a recipe's pattern, converted to BRDFs, checked for outliers, and fitted.
//!
//! A row of a file is a [`LabReading`], a sample of a recipe with all its readings a [`SampleReading`], and its mapped value
//! for the posterior a [`PosteriorReading`](crate::linear::PosteriorReading).

mod alternatives;
mod angle_table;
mod angles;
mod bands;
mod cells;
mod clipping;
mod columns;
mod conventions;
mod distance;
mod fit;
mod gaps;
mod instrument;
mod layout;
mod long;
mod loss_scale;
mod next;
mod noise;
mod optics;
mod outliers;
mod placement;
mod quantity;
mod read;
mod reading_set;
mod readings;
mod recipe;
mod report;
mod rows;
mod spectrum;
mod summary;
mod table;

pub use alternatives::{Alternative, Doubt};
pub use angle_table::{AngleRow, AngleTable};
pub use angles::{angles_from_vectors, polar, rusinkiewicz};
pub use clipping::clipped_rows;
pub use columns::Role;
pub use conventions::{AngleArgs, AngleConvention, AngleUnit};
pub use distance::AngularDistance;
pub use fit::{FitFailure, MaterialFit, Selection};
pub use gaps::{Gaps, GlossGap};
pub use instrument::{Geometry, Instrument};
pub use loss_scale::LossScale;
pub use next::NextReading;
pub use noise::{NoiseSource, NoiseSummary};
pub use optics::Optics;
pub use outliers::{OutlierKind, OutlierSet, Outliers};
pub use quantity::{CountCalibration, LargerSpot, Multiple, ReadingQuantity};
pub use read::TableArgs;
pub use reading_set::{PlannedReading, ReadingSet};
pub use readings::{ReadingStatus, Readings, SampleReading};
pub use recipe::NamedRecipe;
pub use report::{FitReport, InputSummary, MaterialFiles, material_files};
pub use rows::{LabReading, ReadingRows};
pub use spectrum::{SpectrumReading, SpectrumReport};
pub use summary::{ColumnSummary, TableSummary};
pub(crate) use table::Table;
pub use table::{LeftOutRow, TableError};
