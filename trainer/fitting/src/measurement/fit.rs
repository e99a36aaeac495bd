//! Fits of lab readings.

use crate::linear::{Posterior, PosteriorReading};
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::model::ModelKind;
use glimpse_core::scan::Residual;
use glimpse_kernels::scan::LossPrediction;
use glimpse_materials::setting::Name;
use glimpse_materials::{FittedBrdf, FittedMaterial};

use super::alternatives::{Doubt, is_off_highlight};
use super::bands::fit_bands;
use super::outliers::{OutlierKind, Outliers};
use super::readings::{ReadingStatus, Readings, known_readings};

/// The readings of a recipe's samples, and those among them that a fit uses.
#[derive(Clone, Debug)]
pub struct Selection {
    /// The readings, with their status.
    pub readings: Readings,
    /// The outliers among the readings.
    pub outliers: Outliers,
    /// The distribution of the material, given the used readings.
    pub posterior: Posterior,
    /// The known readings, used or not.
    known: Vec<PosteriorReading>,
}

/// The result of a fit.
#[derive(Clone, Debug)]
pub struct MaterialFit {
    /// The fitted material.
    pub material: FittedMaterial,
    /// The readings.
    pub selection: Selection,
    /// The residual at the used readings.
    pub residual: Residual,
    /// Another way to read the file that explains it better; None if there is none.
    pub doubt: Option<Doubt>,
    /// The predicted loss: by the recipe, or else by the posterior of the readings.
    pub prediction: LossPrediction,
}

/// An error of fitting measurements.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitFailure {
    /// Readings are missing, and the recipe needs all of them.
    #[error(
        "{} not measured, but the recipe needs all {samples}; measure them as well, or use a recipe that was trained with \
         {} 0.5",
        samples_of(missing),
        Name("missing")
    )]
    Missing {
        /// The indices of the samples without a reading.
        missing: Vec<usize>,
        /// The number of samples of the recipe.
        samples: usize,
    },
    /// The readings cannot be fitted.
    #[error(transparent)]
    Scan(#[from] Error),
    /// The readings are unlikely to come from a material.
    #[error("{}{}", .0.text(), hint(*.0))]
    Implausible(ErrorCode),
    /// Another way to read the file explains it far better.
    #[error("{0}")]
    Misread(Doubt),
    /// The model is too simple to follow readings in bands.
    #[error(
        "the model {0} cannot follow readings in bands: give a recipe of the model linear or neural, or readings in RGB"
    )]
    Bands(ModelKind),
}

/// Returns the likely cause of implausible readings.
fn hint(reason: ErrorCode) -> String {
    if reason == ErrorCode::Albedo {
        format!(
            "; give {} reflectance-percent if they are percent",
            Name("quantity")
        )
    } else {
        String::new()
    }
}

/// Returns "sample 1, sample 2".
fn samples_of(indices: &[usize]) -> String {
    let names = indices.iter().map(|index| format!("sample {index}"));
    names.collect::<Vec<_>>().join(", ")
}

impl Selection {
    /// Selects the readings of a fit.
    ///
    /// If the recipe tolerates missing readings, the fit does not use saturated readings. It does not use
    /// [excluded](super::OutlierSet::is_excluded) outliers either, unless `keep_all` is true.
    ///
    /// # Errors
    /// [`FitFailure::Missing`] if readings that the recipe needs are missing.
    pub fn new(mut readings: Readings, keep_all: bool) -> Result<Self, FitFailure> {
        let tolerates_missing = readings.recipe.file.recipe().tolerates_missing();
        let missing = readings.indices(|sample| sample.status == ReadingStatus::Missing);
        if !tolerates_missing && !missing.is_empty() {
            return Err(FitFailure::Missing {
                missing,
                samples: readings.samples.len(),
            });
        }
        let known = known_readings(&readings.samples);
        let prior = &readings.recipe.prior;
        let of_samples = known.iter();
        let of_samples = of_samples.filter_map(|index| readings.samples[*index].for_posterior());
        let of_samples: Vec<PosteriorReading> = of_samples.collect();
        let posterior = Posterior::new(prior, &of_samples);
        let mut posterior = posterior.ok_or(Error::new(ErrorCode::Diverged))?;
        let outliers = Outliers::find(posterior.clone(), &known, &mut readings.samples);
        if tolerates_missing {
            for (index, sample) in readings.samples.iter_mut().enumerate() {
                if sample.brdf.saturated && known.binary_search(&index).is_err() {
                    sample.status = ReadingStatus::Saturated;
                }
            }
            let excluded = outliers.sets.iter().filter(|set| set.is_excluded);
            for set in excluded.filter(|_| !keep_all) {
                for sample in &set.samples {
                    readings.samples[*sample].status = match set.kind {
                        OutlierKind::Clipped => ReadingStatus::Saturated,
                        _ => ReadingStatus::Outlier,
                    };
                }
            }
        }
        let is_unused =
            |index: &usize| readings.samples[known[*index]].status != ReadingStatus::Used;
        let unused: Vec<usize> = (0..known.len()).filter(is_unused).collect();
        if !unused.is_empty() {
            let others = posterior.without(&unused);
            posterior = others.ok_or(Error::new(ErrorCode::Diverged))?;
        }
        Ok(Self {
            posterior,
            known: of_samples,
            readings,
            outliers,
        })
    }
}

impl MaterialFit {
    /// Selects readings, and fits them as a device does. `name` is that of the material.
    ///
    /// # Errors
    /// If the model cannot follow readings in bands, readings are missing, or the fit fails as it would on a device.
    pub fn new(readings: Readings, name: String, keep_all: bool) -> Result<Self, FitFailure> {
        let model = readings.recipe.file.recipe().model();
        let is_in_bands = !readings.rows.wavelengths.is_empty();
        if is_in_bands && matches!(model, ModelKind::Phong | ModelKind::CookTorrance) {
            return Err(FitFailure::Bands(model));
        }
        let selection = Selection::new(readings, keep_all)?;
        let readings = &selection.readings;
        let samples = &readings.samples;
        let posterior = &selection.posterior;
        let mut exact = vec![None; samples.len()];
        let readings_of_known = posterior.exact(&selection.known);
        for (sample, brdf) in known_readings(samples).into_iter().zip(readings_of_known) {
            exact[sample] = samples[sample].used().map(|_| brdf);
        }
        let mut read = |index: u16, _| *exact.get(usize::from(index))?;
        let result = readings.recipe.scan(posterior, &mut read)?;
        let basis = readings.recipe.basis_of(posterior);
        let fitted = FittedBrdf::new(model, result.values, basis.as_deref());
        let material = fitted.and_then(|fitted| FittedMaterial::new(name, fitted));
        // The values of a fit that ended are finite, and match the recipe's basis.
        let mut material = material.ok_or(Error::new(ErrorCode::Diverged))?;
        if is_in_bands {
            material = material.with_bands(fit_bands(readings, posterior, &selection.known)?);
        }
        let prediction = result.prediction;
        let mut residual = result.residual;
        // A highlight alone does not determine the albedo.
        let is_known = |reason: &ErrorCode| {
            *reason != ErrorCode::Albedo
                || samples.iter().any(|sample| is_off_highlight(sample.angles))
        };
        residual.implausible = residual.implausible.filter(is_known);
        Ok(Self {
            doubt: Doubt::find(readings, &selection.outliers, posterior),
            prediction: prediction.unwrap_or_else(|| selection.posterior.loss(material.fitted())),
            material,
            selection,
            residual,
        })
    }

    /// Checks that the readings are plausible.
    ///
    /// # Errors
    /// [`FitFailure::Misread`] if another way to read them explains them far better, [`FitFailure::Implausible`] if they are
    /// unlikely to come from a material.
    pub fn check_plausible(&self) -> Result<(), FitFailure> {
        if let Some(doubt) = self.doubt.filter(|doubt| doubt.is_refused) {
            return Err(FitFailure::Misread(doubt));
        }
        let reason = self.residual.implausible;
        reason.map_or(Ok(()), |reason| Err(FitFailure::Implausible(reason)))
    }
}
