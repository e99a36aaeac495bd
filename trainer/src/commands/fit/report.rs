//! The report on a fit: fields for `--json` and `material.json`.

mod text;

use std::path::Path;

use glimpse_core::gonio::Repeated;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Residual;
use glimpse_kernels::scan::LossPrediction;
use glimpse_trainer::measurement::{
    Fit, PartialScan, ReadingQuantity, ReadingStatus, Selection, coefficient_of_variation,
};
use glimpse_training::recipe::Metadata;
use serde::Serialize;

use super::super::expected_loss::{self, caution};

/// The report on a fit. Field names are those of the JSON.
#[derive(Serialize)]
pub(super) struct FitReport {
    trainer: &'static str,
    recipe: RecipeSummary,
    measured: InputSummary,
    readings: ReadingSummary,
    residual: Residual,
    expected_loss: Option<FitLoss>,
    /// Empty if the recipe has no upper bound for scans that end early.
    partial_scans: Vec<PartialScan>,
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
    pub(super) loss: f64,
    pub(super) delta_e: Option<f64>,
}

#[derive(Serialize)]
struct RecipeSummary {
    file: String,
    checksum: String,
    model: &'static str,
    samples: usize,
    takes_missing: bool,
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
    source: LossSource,
    /// With [`LossSource::Readings`]: the upper bound for 90 % of materials, if the recipe has one.
    bound: Option<f32>,
    /// With [`LossSource::Readings`]: true if the readings are unlike those of all training materials; null if the recipe
    /// cannot tell.
    unlike_training: Option<bool>,
    /// With [`LossSource::Validation`]: the standard error over the materials, if there were several.
    standard_error: Option<f32>,
    /// With [`LossSource::Validation`]: the number of materials of the mean; 0 if it is not stated.
    materials: Option<usize>,
    /// Text for the terminal.
    #[serde(skip)]
    text: String,
}

/// The origin of an expected loss.
#[derive(Clone, Copy, Serialize)]
#[serde(rename_all = "kebab-case")]
enum LossSource {
    /// Predicted by the recipe from these readings.
    Readings,
    /// Stated by the recipe: the mean loss on its validation materials.
    Validation,
}

impl FitReport {
    /// Creates the report on a fit of an input file with a recipe.
    ///
    /// # Errors
    /// If the recipe's metadata is malformed.
    pub(super) fn new(
        recipe_path: &Path,
        recipe: &Recipe<'_>,
        input: &Path,
        quantity: &ReadingQuantity,
        fit: &Fit,
    ) -> anyhow::Result<Self> {
        let measured = &fit.selection.measurements;
        let mut report = Self {
            trainer: env!("CARGO_PKG_VERSION"),
            recipe: RecipeSummary {
                file: file_name(recipe_path),
                checksum: format!("{:08x}", recipe.checksum()),
                model: recipe.model().name(),
                samples: recipe.samples(),
                takes_missing: recipe.tolerates_missing(),
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
            partial_scans: fit.partial_scans.clone(),
        };
        // Expected losses hold for materials that reflect light, like all training materials.
        if report.is_mostly_dark() {
            report.expected_loss = None;
            report.partial_scans.clear();
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
        let outliers = report.outliers.iter().map(|outlier| OutlierSummary {
            sample: outlier.sample,
            status: selection.statuses[outlier.sample],
            z: outlier.prediction.z as f32,
            threshold: report.threshold as f32,
            reading: measured[outlier.sample].mean().unwrap_or_default(),
            expected: outlier.prediction.expected,
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

/// Returns true if a fit uses less than half of the samples. Then neither the predicted nor the stated loss of a
/// recipe is reliable.
fn too_few(used: usize, samples: usize) -> bool {
    2 * used < samples
}

/// Returns the loss that the recipe predicts from these readings, or else the loss that it states.
fn expected_loss(recipe: &Recipe<'_>, fit: &Fit) -> anyhow::Result<Option<FitLoss>> {
    let used = fit.selection.with_status(ReadingStatus::Used).len();
    if too_few(used, recipe.samples()) && !recipe.bounds_partial_loss() {
        return Ok(None);
    }
    if let Some(LossPrediction {
        loss,
        bound,
        unlike_training,
    }) = fit.prediction
    {
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
        return Ok(Some(FitLoss {
            loss,
            source: LossSource::Readings,
            bound,
            unlike_training,
            standard_error: None,
            materials: None,
            text: format!(
                "{loss:.4}{at_most}, predicted by the recipe from these readings{unlike}{caution}"
            ),
        }));
    }
    let estimate = Metadata::of(recipe)?
        .expected_loss
        .map(|each| each.estimate);
    Ok(recipe
        .expected_loss()
        .zip(expected_loss::expected_loss(recipe)?)
        .map(|(loss, text)| FitLoss {
            loss,
            source: LossSource::Validation,
            bound: None,
            unlike_training: None,
            standard_error: estimate.and_then(|each| each.standard_error),
            materials: estimate.map(|each| each.materials),
            text,
        }))
}
