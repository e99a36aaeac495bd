//! From what was measured to a fitted material.

use glimpse_core::gonio::Repeated;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Residual;
use glimpse_kernels::scan::{HostScanError, scan_some};
use glimpse_materials::display_with_setting_names;
use glimpse_materials::setting::{NamesSettings, Naming, Setting};
use serde::Serialize;

use super::measured::Measured;
use super::outliers::{Distribution, Examined};

/// What becomes of a sample's reading. Files hold it as a code: `used`, `missing`, `saturated` or `outlier`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ReadingStatus {
    /// The fit goes by it.
    Used,
    /// There is none.
    Missing,
    /// The sensor was at its end, and the recipe can do without it.
    Saturated,
    /// It looks wrong, and the recipe can do without it.
    #[serde(rename = "outlier")]
    Excluded,
}

impl ReadingStatus {
    /// In a word.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Used => "used",
            Self::Missing => "missing",
            Self::Saturated => "saturated",
            Self::Excluded => "left out",
        }
    }
}

/// What was found from what was read.
#[derive(Clone, Debug)]
pub struct Fit {
    /// A model's parameters in its order, or Linear's coefficients, m for red, m for green, m for
    /// blue.
    pub values: Vec<f32>,
    /// How well they explain the readings that were used, if that is told.
    pub residual: Option<Residual>,
    /// The loss that the fit is likely to have, where the recipe predicts one from readings.
    pub predicted_loss: Option<f32>,
    /// What became of each sample's reading.
    pub fates: Vec<ReadingStatus>,
    /// What the other readings say of them.
    pub examined: Examined,
}

/// Why measurements are not fitted.
#[derive(Clone, Debug, PartialEq)]
pub enum FitFailure {
    /// Readings are missing that the recipe cannot do without.
    Missing {
        /// The samples that are missing.
        missing: Vec<usize>,
        /// How many samples the recipe has.
        samples: usize,
    },
    /// The readings cannot be fitted.
    Scan(HostScanError),
}

impl NamesSettings for FitFailure {
    fn message(&self, name: Naming) -> String {
        match self {
            Self::Missing { missing, samples } => format!(
                "{} not measured, and this recipe needs all {samples}: read {} too, or scan by a \
                 recipe that was trained with {} of 0.5",
                list(missing),
                if missing.len() == 1 { "it" } else { "them" },
                name(Setting::Missing)
            ),
            Self::Scan(error) => error.to_string(),
        }
    }
}

display_with_setting_names!(FitFailure);
impl std::error::Error for FitFailure {}

impl From<HostScanError> for FitFailure {
    fn from(error: HostScanError) -> Self {
        Self::Scan(error)
    }
}

fn list(missing: &[usize]) -> String {
    let names: Vec<String> = missing.iter().map(usize::to_string).collect();
    match missing.len() {
        1 => format!("sample {} was", names.join(", ")),
        _ => format!("samples {} were", names.join(", ")),
    }
}

/// Looks at what was measured, and fits it as a device does. Where the recipe can do without some
/// readings, those that are saturated are left out, and those that look wrong, unless `keep_all`.
///
/// # Errors
/// If readings are missing that the recipe needs, or a device would give up.
pub fn fit(recipe: &Recipe<'_>, measured: &Measured, keep_all: bool) -> Result<Fit, FitFailure> {
    let can_do_without = recipe.tolerates_missing();
    let missing = measured.missing();
    if !can_do_without && !missing.is_empty() {
        return Err(FitFailure::Missing {
            missing,
            samples: recipe.samples(),
        });
    }
    let examined = examine(recipe, measured);
    // If all are saturated they count nevertheless, as on a device.
    let is_clear = |sample: &Repeated| sample.count() > 0 && !sample.saturated();
    let some_are_clear = measured.samples.iter().any(is_clear);
    let fate = |(index, sample): (usize, &Repeated)| match () {
        () if sample.count() == 0 => ReadingStatus::Missing,
        () if can_do_without && some_are_clear && sample.saturated() => ReadingStatus::Saturated,
        () if can_do_without && !keep_all && examined.suspects(index) => ReadingStatus::Excluded,
        () => ReadingStatus::Used,
    };
    let fates: Vec<ReadingStatus> = measured.samples.iter().enumerate().map(fate).collect();
    let found = scan_some(recipe, &mut |index, _| {
        let index = usize::from(index);
        let mean = measured.samples.get(index)?.mean()?;
        (fates.get(index) == Some(&ReadingStatus::Used)).then_some(mean)
    })?;
    Ok(Fit {
        values: found.values,
        residual: Some(found.residual),
        predicted_loss: found.predicted_loss,
        fates,
        examined,
    })
}

/// What the readings say of each other; nothing of those that are saturated, since what they are is
/// not known, nor where there are too many samples to look at.
pub(super) fn examine(recipe: &Recipe<'_>, measured: &Measured) -> Examined {
    let samples = measured.samples.iter();
    let readings: Vec<Option<[f32; 3]>> = samples
        .map(|sample| sample.mean().filter(|_| !sample.saturated()))
        .collect();
    match Distribution::new(recipe) {
        Some(distribution) => distribution.examine(&readings),
        None => Examined::nothing(readings.len()),
    }
}
