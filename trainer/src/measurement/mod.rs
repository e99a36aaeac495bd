//! Lab readings. They are matched to a recipe's pattern, converted to BRDFs, checked for outliers, and fitted.

mod angles;
mod columns;
mod device;
mod fit;
mod matching;
mod measurements;
mod outliers;
mod quantity;
mod rows;
mod table;

pub use angles::{AngleRow, AngleTable, angles_from_vectors};
pub use device::{DeviceError, DeviceReport};
pub use fit::{Fit, FitFailure, PartialScan, ReadingStatus, fit};
pub use matching::{AngularDistance, IsotropicAngles};
pub use measurements::{Measurements, coefficient_of_variation};
pub use outliers::{
    Distribution, MAX_SAMPLES, Outlier, OutlierReport, Prediction, outlier_threshold,
};
pub use quantity::{CountCalibration, ReadingQuantity, WhiteReference};
pub use rows::LabReading;
pub use table::TableError;
