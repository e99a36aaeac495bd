//! The report on a fit: fields for `--json` and `material.json`.

mod text;

use std::path::Path;

use glimpse_core::gonio::Repeated;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Residual;
use glimpse_evaluation::conversion::WrittenErrors;
use glimpse_fitting::measurement::{
    ChosenRecipe, Fit, ReadingQuantity, ReadingStatus, Selection, coefficient_of_variation,
};
use glimpse_kernels::scan::LossPrediction;
use serde::Serialize;

use super::super::expected_loss::caution;
use super::spectrum::{SpectrumReport, ViewingArgs};

/// The report on a fit. Field names are those of the JSON.
#[derive(Serialize)]
pub(super) struct FitReport {
    trainer: &'static str,
    recipe: RecipeSummary,
    measured: InputSummary,
    readings: ReadingSummary,
    residual: Residual,
    expected_loss: Option<FitLoss>,
    /// Null without bands.
    pub(super) spectrum: Option<SpectrumReport>,
}

/// An entry of `--json`: a report with the material's name and folder.
#[derive(Serialize)]
pub(super) struct ReportEntry<'a> {
    pub(super) name: &'a str,
    pub(super) folder: String,
    /// The files of --format.
    pub(super) formats: Vec<FormatSummary>,
    #[serde(flatten)]
    pub(super) report: FitReport,
}

/// The first file of a format, and its errors against the fit.
#[derive(Serialize)]
pub(super) struct FormatSummary {
    pub(super) file: String,
    #[serde(flatten)]
    pub(super) errors: WrittenErrors,
}

#[derive(Serialize)]
struct RecipeSummary {
    file: String,
    checksum: String,
    model: &'static str,
    samples: usize,
    takes_missing: bool,
    /// True if the readings are not at the given recipe's directions, and another recipe fits them.
    off_pattern: bool,
    /// The reason, for the terminal.
    #[serde(skip)]
    reason: Option<String>,
}

#[derive(Serialize)]
struct InputSummary {
    /// The input's file name, without directories.
    file: String,
    /// The quantity of its numbers, as a column `quantity` names it.
    quantity: &'static str,
    rows: usize,
    /// The largest distance of a row from its sample, in degrees; null if rows have no directions.
    furthest_degrees: Option<f64>,
}

/// Counts and lists of samples, by the state of their readings.
#[derive(Serialize)]
struct ReadingSummary {
    /// Number of readings that the fit used.
    used: usize,
    /// The samples whose readings the fit did not use.
    unused: Vec<UnusedSample>,
    /// Samples with a saturated reading, used or not.
    saturated: Vec<usize>,
    /// Samples whose reading is 0 or below in all channels.
    no_light: Vec<usize>,
    /// Number of samples with several readings.
    repeated: usize,
    /// The largest coefficient of variation of repeated readings.
    largest_spread: Option<f32>,
    /// The sample with the largest coefficient of variation.
    most_spread: Option<usize>,
    /// Readings that are improbable given the other readings, used or not.
    outliers: Vec<OutlierSummary>,
}

#[derive(Serialize)]
struct UnusedSample {
    sample: usize,
    status: ReadingStatus,
}

#[derive(Serialize)]
struct OutlierSummary {
    sample: usize,
    status: ReadingStatus,
    z: f32,
    /// The magnitude of z above which a reading is an outlier.
    threshold: f32,
    /// The reading as a BRDF, sr^-1.
    reading: [f32; 3],
    /// The BRDF predicted from the other readings, sr^-1.
    expected: [f32; 3],
}

/// The expected loss of this fit.
#[derive(Serialize)]
struct FitLoss {
    loss: f32,
    /// The upper bound for 90 % of materials; null if the recipe has none.
    bound: Option<f32>,
    /// True if the readings are unlike those of all training materials; null if the recipe cannot tell.
    unlike_training: Option<bool>,
    /// Text for the terminal.
    #[serde(skip)]
    text: String,
}

impl FitReport {
    /// Creates the report on a fit of an input file with a recipe.
    ///
    /// # Errors
    /// If the recipe's metadata is malformed.
    pub(super) fn new(
        chosen: &ChosenRecipe,
        input: &Path,
        quantity: &ReadingQuantity,
        fit: &Fit,
        viewing: &ViewingArgs,
    ) -> anyhow::Result<Self> {
        let measured = &fit.selection.measurements;
        let recipe = &chosen.recipe.file.recipe();
        let mut report = Self {
            trainer: env!("CARGO_PKG_VERSION"),
            recipe: RecipeSummary {
                file: chosen.recipe.name.clone(),
                checksum: format!("{:08x}", recipe.checksum()),
                model: recipe.model().name(),
                samples: recipe.samples(),
                takes_missing: recipe.tolerates_missing(),
                off_pattern: chosen.off_pattern.is_some(),
                reason: chosen.off_pattern.clone(),
            },
            measured: InputSummary {
                file: file_name(input),
                quantity: quantity.name(),
                rows: measured.rows,
                furthest_degrees: measured
                    .max_distance
                    .map(|distance| distance.radians.to_degrees()),
            },
            readings: ReadingSummary::new(&fit.selection),
            residual: fit.residual,
            expected_loss: expected_loss(recipe, fit)?,
            spectrum: SpectrumReport::new(fit, &recipe.pattern().collect::<Vec<_>>(), viewing),
        };
        // Expected losses hold for materials that reflect light, like all training materials.
        if report.is_mostly_dark() {
            report.expected_loss = None;
        }
        Ok(report)
    }

    /// Returns true if most readings have no light.
    fn is_mostly_dark(&self) -> bool {
        let read = self.recipe.samples - self.readings.with_status(ReadingStatus::Missing).len();
        2 * self.readings.no_light.len() > read
    }
}

impl ReadingSummary {
    fn new(selection: &Selection) -> Self {
        let measured = &selection.measurements.samples;
        let samples_where = |holds: fn(&Repeated) -> bool| {
            let all = measured.iter().enumerate();
            let matching = all.filter(|(_, sample)| holds(sample));
            matching.map(|(index, _)| index).collect::<Vec<usize>>()
        };
        let spreads = measured.iter().enumerate();
        let spreads =
            spreads.filter_map(|(index, sample)| Some((index, coefficient_of_variation(sample)?)));
        let most_spread = spreads.max_by(|(_, one), (_, other)| one.total_cmp(other));
        let unused = selection.statuses.iter().enumerate();
        let unused = unused.filter(|(_, status)| **status != ReadingStatus::Used);
        let report = &selection.outlier_report;
        let outliers = report.outliers.iter().filter_map(|sample| {
            let prediction = report.predictions[*sample]?;
            Some(OutlierSummary {
                sample: *sample,
                status: selection.statuses[*sample],
                z: prediction.z as f32,
                threshold: report.threshold as f32,
                reading: measured[*sample].mean()?,
                expected: prediction.expected,
            })
        });
        Self {
            used: selection.with_status(ReadingStatus::Used).len(),
            unused: unused
                .map(|(sample, status)| UnusedSample {
                    sample,
                    status: *status,
                })
                .collect(),
            saturated: samples_where(Repeated::saturated),
            no_light: samples_where(|sample| {
                let mean = sample.mean();
                mean.is_some_and(|mean| mean.into_iter().all(|value| value <= 0.0))
            }),
            repeated: samples_where(|sample| sample.count() > 1).len(),
            largest_spread: most_spread.map(|(_, spread)| spread),
            most_spread: most_spread.map(|(index, _)| index),
            outliers: outliers.collect(),
        }
    }

    /// Returns the samples with a status other than used.
    fn with_status(&self, status: ReadingStatus) -> Vec<usize> {
        let unused = self.unused.iter();
        let matching = unused.filter(|unused| unused.status == status);
        matching.map(|unused| unused.sample).collect()
    }
}

/// Returns the name of a file without directories.
pub(super) fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// Returns true if a fit uses less than half of the samples. Then the loss that a recipe predicts is not reliable.
fn too_few(used: usize, samples: usize) -> bool {
    2 * used < samples
}

/// Returns the loss that is predicted from these readings.
fn expected_loss(recipe: &Recipe<'_>, fit: &Fit) -> anyhow::Result<Option<FitLoss>> {
    let used = fit.selection.with_status(ReadingStatus::Used).len();
    if too_few(used, recipe.samples()) && !recipe.bounds_partial_loss() {
        return Ok(None);
    }
    let LossPrediction {
        loss,
        bound,
        unlike_training,
    } = fit.prediction;
    let caution = caution(recipe)?.map_or_else(String::new, |caution| format!("; {caution}"));
    let at_most = bound.map_or_else(String::new, |bound| {
        format!(" (at most {bound:.4} for 90 % of materials)")
    });
    let unlike = match unlike_training {
        Some(true) => {
            "; the readings are unlike those of all training materials, so the loss may be larger"
        }
        _ => "",
    };
    Ok(Some(FitLoss {
        loss,
        bound,
        unlike_training,
        text: format!("{loss:.4}{at_most}, predicted from these readings{unlike}{caution}"),
    }))
}
