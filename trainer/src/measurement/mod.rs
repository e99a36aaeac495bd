//! Readings from a lab: matched to a recipe's pattern, turned into BRDFs, looked at, and fitted.

mod angles;
mod columns;
mod device;
mod fit;
mod matching;
mod measured;
mod outliers;
mod quantity;
mod rows;
mod table;

pub use angles::{AngleRow, AngleTable, angles_of_pair};
pub use device::{DeviceError, DeviceReport};
pub use fit::{Fit, FitFailure, ReadingStatus, fit};
pub use matching::{Arms, Distance};
pub use measured::{Measured, spread};
pub use outliers::{Distribution, Examined, MOST_SAMPLES, Outlier, Prediction, looks_wrong};
pub use quantity::{Counts, Meaning, White};
pub use rows::Taken;
pub use table::TableError;
