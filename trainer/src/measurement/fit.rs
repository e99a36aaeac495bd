//! Fits of lab measurements.

use std::path::{Path, PathBuf};

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::gonio::Repeated;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Residual;
use glimpse_kernels::scan::{
    BoundedPrediction, LossPrediction, ScanOutcome, bounded_prediction, scan_with_missing,
};
use glimpse_materials::basis::Basis;
use glimpse_materials::setting::{Setting, SettingError, SettingNames};
use glimpse_materials::{BasisFile, FittedBrdf, FittedMaterial};
use serde::Serialize;

use super::measurements::Measurements;
use super::outliers::{Distribution, OutlierReport};

/// The status of a sample's reading in a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ReadingStatus {
    /// The fit uses the reading.
    Used,
    /// The sample has no reading.
    Missing,
    /// The fit does not use the reading, because it is saturated.
    Saturated,
    /// The fit does not use the reading, because it is an outlier.
    Outlier,
}

impl ReadingStatus {
    /// Returns the name in files, reports and Python.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Used => "used",
            Self::Missing => "missing",
            Self::Saturated => "saturated",
            Self::Outlier => "outlier",
        }
    }
}

/// The readings of a recipe's samples, and those among them that a fit uses.
#[derive(Clone, Debug)]
pub struct Selection {
    /// The readings.
    pub measurements: Measurements,
    /// The status of each sample's reading.
    pub statuses: Vec<ReadingStatus>,
    /// The outliers among the readings.
    pub outlier_report: OutlierReport,
}

/// The result of a fit.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The fitted material.
    pub material: FittedMaterial,
    /// The readings.
    pub selection: Selection,
    /// The residual at the used readings.
    pub residual: Residual,
    /// The recipe's prediction of the loss; None if it has no loss predictor.
    pub prediction: Option<LossPrediction>,
    /// The predictions after each used reading, in the recipe's order; empty if the recipe has no upper bound for scans
    /// that end early.
    pub partial_scans: Vec<PartialScan>,
}

/// The prediction for a scan that ends after its first readings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PartialScan {
    /// The number of readings.
    pub readings: usize,
    /// The expected loss.
    pub loss: f32,
    /// The upper bound of the loss, which holds for 90 % of materials.
    pub bound: f32,
}

/// An error of fitting measurements.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{}", self.message(Setting::name))]
pub enum FitFailure {
    /// Readings are missing, and the recipe needs all of them.
    Missing {
        /// The indices of the samples without a reading.
        missing: Vec<usize>,
        /// The number of samples of the recipe.
        samples: usize,
    },
    /// The readings cannot be fitted.
    Scan(Error),
}

impl SettingError for FitFailure {
    fn message(&self, name: SettingNames) -> String {
        match self {
            Self::Missing { missing, samples } => format!(
                "{} not measured, but the recipe needs all {samples}; measure {} as well, or use a recipe that was \
                 trained with {} 0.5",
                samples_were(missing),
                if missing.len() == 1 { "it" } else { "them" },
                name(Setting::Missing)
            ),
            Self::Scan(error) => error.to_string(),
        }
    }
}

impl From<Error> for FitFailure {
    fn from(error: Error) -> Self {
        Self::Scan(error)
    }
}

/// Returns "sample 1 was" or "samples 1, 2 were".
fn samples_were(indices: &[usize]) -> String {
    let numbers: Vec<String> = indices.iter().map(usize::to_string).collect();
    match indices.len() {
        1 => format!("sample {} was", numbers.join(", ")),
        _ => format!("samples {} were", numbers.join(", ")),
    }
}

impl Selection {
    /// Selects the readings of a fit.
    ///
    /// If the recipe tolerates missing readings, the fit does not use saturated readings. It does not use the worst
    /// outlier either, if the other readings agree better without it, unless `keep_all` is true.
    ///
    /// # Errors
    /// [`FitFailure::Missing`] if readings that the recipe needs are missing.
    pub fn new(
        recipe: &Recipe<'_>,
        measurements: Measurements,
        keep_all: bool,
    ) -> Result<Self, FitFailure> {
        let tolerates_missing = recipe.tolerates_missing();
        let missing = measurements.missing();
        if !tolerates_missing && !missing.is_empty() {
            return Err(FitFailure::Missing {
                missing,
                samples: recipe.samples(),
            });
        }
        let outlier_report = find_outliers(recipe, &measurements);
        // If all readings are saturated, the fit uses them, as on a device.
        let is_unsaturated = |sample: &Repeated| sample.count() > 0 && !sample.saturated();
        let any_unsaturated = measurements.samples.iter().any(is_unsaturated);
        let status = |(index, sample): (usize, &Repeated)| {
            if sample.count() == 0 {
                ReadingStatus::Missing
            } else if tolerates_missing && any_unsaturated && sample.saturated() {
                ReadingStatus::Saturated
            } else if tolerates_missing && !keep_all && outlier_report.excluded == Some(index) {
                ReadingStatus::Outlier
            } else {
                ReadingStatus::Used
            }
        };
        let statuses = measurements.samples.iter().enumerate().map(status);
        Ok(Self {
            statuses: statuses.collect(),
            measurements,
            outlier_report,
        })
    }

    /// Returns the readings that the fit uses: the BRDF of each sample in linear RGB, sr^-1, and None for the others.
    #[must_use]
    pub fn used(&self) -> Vec<Option<[f32; 3]>> {
        let samples = self.measurements.samples.iter().zip(&self.statuses);
        let used = samples
            .map(|(sample, status)| sample.mean().filter(|_| *status == ReadingStatus::Used));
        used.collect()
    }

    /// Returns the samples with this status.
    #[must_use]
    pub fn with_status(&self, status: ReadingStatus) -> Vec<usize> {
        let all = self.statuses.iter().enumerate();
        let matching = all.filter(|(_, actual)| **actual == status);
        matching.map(|(index, _)| index).collect()
    }
}

/// Fits readings as a device does. The basis is needed for the model Linear; `name` is that of the material.
///
/// # Errors
/// If the fit fails as it would on a device.
pub fn fit(
    recipe: &Recipe<'_>,
    basis: Option<&Basis>,
    name: String,
    selection: Selection,
) -> Result<Fit, FitFailure> {
    let used = selection.used();
    let result = scan_first(recipe, &used, used.len())?;
    let fitted = FittedBrdf::new(recipe.model(), result.values, basis);
    let material = fitted.and_then(|fitted| FittedMaterial::new(name, fitted));
    Ok(Fit {
        // The values of a fit that ended are finite, and match the recipe's basis.
        material: material.ok_or(Error::new(ErrorCode::Diverged))?,
        selection,
        residual: result.residual,
        prediction: result.prediction,
        partial_scans: partial_scans(recipe, &used),
    })
}

/// Files that belong together: their paths and contents.
pub type MaterialFiles = Vec<(PathBuf, Vec<u8>)>;

/// Returns the file of a fitted material, and for the model Linear that of its basis next to it, `NAME.basis`.
///
/// # Errors
/// If `metadata` is neither a map nor a struct.
pub fn material_files(
    material: &FittedMaterial,
    path: &Path,
    basis: Option<&Basis>,
    metadata: impl Serialize,
) -> serde_json::Result<MaterialFiles> {
    let basis_path = path.with_extension("basis");
    let name = basis_path.file_name().unwrap_or_default().to_string_lossy();
    let reference = basis.map(|basis| BasisFile::new(name.into_owned(), basis.whole_checksum()));
    let json = material.to_json(reference.as_ref(), metadata)?;
    let basis = basis.map(|basis| (basis_path.clone(), basis.to_bytes()));
    let files = basis
        .into_iter()
        .chain([(path.to_owned(), json.into_bytes())]);
    Ok(files.collect())
}

/// Fits the readings among the first `count` samples.
fn scan_first(
    recipe: &Recipe<'_>,
    readings: &[Option<[f32; 3]>],
    count: usize,
) -> Result<ScanOutcome, Error> {
    scan_with_missing(recipe, &mut |index, _| {
        *readings[..count].get(usize::from(index))?
    })
}

/// Fits the readings again after each of them. Empty if the recipe has no upper bound for scans that end early. Fits that a
/// device would not use are omitted.
fn partial_scans(recipe: &Recipe<'_>, readings: &[Option<[f32; 3]>]) -> Vec<PartialScan> {
    let mut scans = Vec::new();
    if !recipe.bounds_partial_loss() {
        return scans;
    }
    let read = (0..readings.len()).filter(|index| readings[*index].is_some());
    for (count, index) in (1..).zip(read) {
        let result = scan_first(recipe, readings, index + 1);
        if let Some(BoundedPrediction { loss, bound }) = bounded_prediction(&result) {
            scans.push(PartialScan {
                readings: count,
                loss,
                bound,
            });
        }
    }
    scans
}

/// Finds outliers among the readings. Saturated readings are skipped because their values are unknown. No reading is
/// checked if the recipe has more than [`MAX_SAMPLES`](super::MAX_SAMPLES) samples.
fn find_outliers(recipe: &Recipe<'_>, measurements: &Measurements) -> OutlierReport {
    let samples = measurements.samples.iter();
    let readings: Vec<Option<[f32; 3]>> = samples
        .map(|sample| sample.mean().filter(|_| !sample.saturated()))
        .collect();
    match Distribution::new(recipe) {
        Some(distribution) => distribution.find_outliers(&readings),
        None => OutlierReport::empty(readings.len()),
    }
}
