//! Fits of lab measurements.

use std::path::{Path, PathBuf};

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::gonio::Repeated;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Residual;
use glimpse_kernels::scan::{LossPrediction, scan_with_missing};
use glimpse_materials::basis::Basis;
use glimpse_materials::setting::{Setting, SettingError, SettingNames};
use glimpse_materials::{BasisFile, FittedBrdf, FittedMaterial};
use glimpse_training::linear::{CoefficientPrior, Posterior, PosteriorReading};
use serde::Serialize;

use super::bands::fit_bands;
use super::measurements::Measurements;
use super::outliers::OutlierReport;

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
    /// The distribution of the material, given the used readings.
    pub posterior: Posterior,
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
    /// The predicted loss: by the recipe, or else by the posterior of the readings.
    pub prediction: LossPrediction,
}

impl Fit {
    /// Checks that the readings are plausible.
    ///
    /// # Errors
    /// [`FitFailure::Implausible`] if they are unlikely to come from a material.
    pub fn check_plausible(&self) -> Result<(), FitFailure> {
        let reason = self.residual.implausible;
        reason.map_or(Ok(()), |reason| Err(FitFailure::Implausible(reason)))
    }
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
    /// The readings are unlikely to come from a material.
    Implausible(ErrorCode),
    /// The model is too simple to follow readings in bands.
    Bands(ModelKind),
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
            Self::Implausible(reason) => reason.text().to_owned(),
            Self::Bands(model) => format!(
                "the model {model} cannot follow readings in bands: give a recipe of the model linear or neural, or \
                 readings in RGB"
            ),
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
        prior: &CoefficientPrior,
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
        let readings = posterior_readings(recipe, &measurements);
        let outlier_report = OutlierReport::new(prior, &readings);
        // If all readings are saturated, the fit uses them, as on a device.
        let any_unsaturated = measurements.any_unsaturated();
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
        let statuses: Vec<ReadingStatus> = statuses.collect();
        let is_used = |(_, status): &(_, &ReadingStatus)| **status == ReadingStatus::Used;
        let used = readings.into_iter().zip(&statuses).filter(is_used);
        let used: Vec<PosteriorReading> = used.filter_map(|(reading, _)| reading).collect();
        let posterior = Posterior::new(prior, &used).ok_or(Error::new(ErrorCode::Diverged))?;
        Ok(Self {
            statuses,
            measurements,
            outlier_report,
            posterior,
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
    let result = scan_with_missing(recipe, &mut |index, _| *used.get(usize::from(index))?)?;
    let fitted = FittedBrdf::new(recipe.model(), result.values, basis);
    let material = fitted.and_then(|fitted| FittedMaterial::new(name, fitted));
    // The values of a fit that ended are finite, and match the recipe's basis.
    let mut material = material.ok_or(Error::new(ErrorCode::Diverged))?;
    let measurements = &selection.measurements;
    if !measurements.wavelengths.is_empty() {
        if let model @ (ModelKind::Phong | ModelKind::CookTorrance) = recipe.model() {
            return Err(FitFailure::Bands(model));
        }
        let spectra = measurements.spectra.iter().zip(&used);
        let spectra = spectra.map(|(spectrum, used)| used.map_or(&[][..], |_| &spectrum[..]));
        let spectra: Vec<&[f32]> = spectra.collect();
        let bands = fit_bands(recipe, basis, &measurements.wavelengths, &spectra)?;
        material = material.with_bands(bands);
    }
    let prediction = result.prediction;
    Ok(Fit {
        prediction: prediction.unwrap_or_else(|| selection.posterior.loss(material.fitted())),
        material,
        selection,
        residual: result.residual,
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

/// Returns the readings of a recipe's samples. Those of saturated readings are None, because their values are unknown,
/// unless all are saturated.
fn posterior_readings(
    recipe: &Recipe<'_>,
    measurements: &Measurements,
) -> Vec<Option<PosteriorReading>> {
    let any_unsaturated = measurements.any_unsaturated();
    let samples = recipe.pattern().zip(&measurements.samples).enumerate();
    let each = samples.map(|(index, (angles, sample))| {
        let mean = sample
            .mean()
            .filter(|_| !any_unsaturated || !sample.saturated());
        mean.map(|brdf| PosteriorReading::of_sample(recipe, index, angles, brdf))
    });
    each.collect()
}
