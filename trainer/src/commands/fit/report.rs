//! The report on a fit: fields for `--json` and `material.json`.

mod text;

use std::path::Path;

use glimpse_core::error::ErrorCode;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Residual;
use glimpse_kernels::scan::LossPrediction;
use glimpse_trainer::measurement::{
    AngularDistance, Fit, Measurements, OutlierReport, PartialScan, ReadingQuantity, ReadingStatus,
    coefficient_of_variation,
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
    residual: Option<ResidualSummary>,
    expected_loss: Option<FitLoss>,
    /// Empty if the recipe has no upper bound for scans that end early.
    partial_scans: Vec<PartialScan>,
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
    /// The quantity, as text for the terminal.
    #[serde(skip)]
    quantity_text: String,
    rows: usize,
    #[serde(skip)]
    furthest: Option<AngularDistance>,
    /// The largest distance of a row from its sample, in degrees.
    furthest_degrees: Option<f64>,
}

/// Counts and lists of samples, by the state of their readings.
#[derive(Serialize)]
struct ReadingSummary {
    /// Number of readings that the fit used.
    used: usize,
    /// The samples whose readings the fit did not use, for any reason.
    excluded: Vec<ExcludedSample>,
    missing: Vec<usize>,
    /// Samples with a saturated reading, used or not.
    saturated: Vec<usize>,
    /// Samples whose reading the fit excluded as an outlier.
    #[serde(rename = "left_out")]
    excluded_outliers: Vec<usize>,
    /// Samples whose reading is 0 or below in all channels.
    no_light: Vec<usize>,
    /// Number of samples with several readings.
    repeated: usize,
    /// The largest coefficient of variation of repeated readings.
    largest_spread: Option<f32>,
    /// The sample with the largest coefficient of variation.
    most_spread: Option<usize>,
    #[serde(rename = "looks_wrong")]
    outliers: Vec<OutlierSummary>,
}

/// A sample whose reading the fit did not use.
#[derive(Serialize)]
struct ExcludedSample {
    sample: usize,
    reason: ReadingStatus,
}

/// A reading that is improbable given the other readings.
#[derive(Serialize)]
struct OutlierSummary {
    sample: usize,
    z: f32,
    /// The magnitude of z above which a reading is an outlier.
    #[serde(rename = "limit")]
    threshold: f32,
    /// The reading as a BRDF, sr^-1.
    #[serde(rename = "read")]
    reading: [f32; 3],
    /// The BRDF predicted from the other readings, sr^-1.
    expected: [f32; 3],
}

#[derive(Serialize)]
struct ResidualSummary {
    mean: f32,
    worst: f32,
    worst_index: u16,
    implausible: Option<ErrorCode>,
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

/// The first file of a format, and its errors against the fit.
#[derive(Clone, Serialize)]
pub(super) struct FormatSummary {
    pub(super) file: String,
    pub(super) loss: f64,
    pub(super) delta_e: Option<f64>,
}

/// An entry of `--json`: a report with the material's name and folder.
#[derive(Serialize)]
pub(super) struct ReportEntry<'a> {
    name: &'a str,
    folder: String,
    /// The files of --format.
    formats: Vec<FormatSummary>,
    #[serde(flatten)]
    report: &'a FitReport,
}

impl FitReport {
    /// Creates the report on a fit with a recipe of this file name.
    ///
    /// # Errors
    /// If the recipe's metadata is malformed.
    pub(super) fn new(
        recipe_file: String,
        recipe: &Recipe<'_>,
        input: &Path,
        quantity: &ReadingQuantity,
        measured: &Measurements,
        fit: &Fit,
    ) -> anyhow::Result<Self> {
        let name = input.file_name().unwrap_or_default();
        let spreads = measured.samples.iter().enumerate();
        let spreads =
            spreads.filter_map(|(index, sample)| Some((index, coefficient_of_variation(sample)?)));
        let most_spread = spreads.max_by(|(_, one), (_, other)| one.total_cmp(other));
        let mut report = Self {
            trainer: env!("CARGO_PKG_VERSION"),
            recipe: RecipeSummary {
                file: recipe_file,
                checksum: format!("{:08x}", recipe.checksum()),
                model: recipe.model().name(),
                samples: recipe.samples(),
                takes_missing: recipe.tolerates_missing(),
            },
            measured: InputSummary {
                file: name.to_string_lossy().into_owned(),
                quantity: quantity.name(),
                quantity_text: match quantity {
                    ReadingQuantity::Values(quantity) => quantity.to_string(),
                    ReadingQuantity::Counts(_) => "counts, relative to a white tile".to_owned(),
                },
                rows: measured.rows,
                furthest: measured.max_distance,
                furthest_degrees: measured
                    .max_distance
                    .map(|distance| distance.radians.to_degrees()),
            },
            readings: ReadingSummary {
                used: samples_with(fit, ReadingStatus::Used).len(),
                excluded: excluded(fit),
                missing: samples_with(fit, ReadingStatus::Missing),
                saturated: saturated(measured),
                excluded_outliers: samples_with(fit, ReadingStatus::Excluded),
                no_light: no_light(measured),
                repeated: measured.samples.iter().filter(|s| s.count() > 1).count(),
                largest_spread: most_spread.map(|(_, spread)| spread),
                most_spread: most_spread.map(|(index, _)| index),
                outliers: outliers(measured, &fit.outlier_report),
            },
            residual: fit.residual.map(|residual| {
                let Residual {
                    mean,
                    worst,
                    worst_index,
                    implausible,
                    ..
                } = residual;
                ResidualSummary {
                    mean,
                    worst,
                    worst_index,
                    implausible,
                }
            }),
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

    /// Returns the entry of `--json` for a material and its folder.
    pub(super) fn entry<'a>(
        &'a self,
        name: &'a str,
        folder: &Path,
        formats: &[FormatSummary],
    ) -> ReportEntry<'a> {
        ReportEntry {
            formats: formats.to_vec(),
            name,
            folder: folder.display().to_string(),
            report: self,
        }
    }

    /// Returns true if most readings have no light.
    fn is_mostly_dark(&self) -> bool {
        let read = self.recipe.samples - self.readings.missing.len();
        2 * self.readings.no_light.len() > read
    }
}

/// Returns the samples whose mean reading is 0 or below in all channels.
fn no_light(measured: &Measurements) -> Vec<usize> {
    let all = measured.samples.iter().enumerate();
    let dark = all.filter(|(_, sample)| {
        let mean = sample.mean();
        mean.is_some_and(|mean| mean.into_iter().all(|value| value <= 0.0))
    });
    dark.map(|(index, _)| index).collect()
}

/// Returns the samples with a saturated reading.
fn saturated(measured: &Measurements) -> Vec<usize> {
    let all = measured.samples.iter().enumerate();
    let saturated = all.filter(|(_, sample)| sample.saturated());
    saturated.map(|(index, _)| index).collect()
}

/// Returns true if a fit uses less than half of the samples. Then neither the predicted nor the stated loss of a
/// recipe is reliable.
fn too_few(used: usize, samples: usize) -> bool {
    2 * used < samples
}

/// Returns the samples that the fit did not use, with the reasons.
fn excluded(fit: &Fit) -> Vec<ExcludedSample> {
    let all = fit.statuses.iter().enumerate();
    let others = all.filter(|(_, status)| **status != ReadingStatus::Used);
    others
        .map(|(sample, reason)| ExcludedSample {
            sample,
            reason: *reason,
        })
        .collect()
}

fn samples_with(fit: &Fit, status: ReadingStatus) -> Vec<usize> {
    let all = fit.statuses.iter().enumerate();
    let matching = all.filter(|(_, actual)| **actual == status);
    matching.map(|(index, _)| index).collect()
}

fn outliers(measured: &Measurements, outlier_report: &OutlierReport) -> Vec<OutlierSummary> {
    let outliers = outlier_report
        .outliers
        .iter()
        .map(|outlier| OutlierSummary {
            sample: outlier.sample,
            z: outlier.prediction.z as f32,
            threshold: outlier_report.threshold as f32,
            reading: measured.samples[outlier.sample].mean().unwrap_or_default(),
            expected: outlier.prediction.expected,
        });
    outliers.collect()
}

/// Returns the loss that the recipe predicts from these readings, or else the loss that it states.
fn expected_loss(recipe: &Recipe<'_>, fit: &Fit) -> anyhow::Result<Option<FitLoss>> {
    let used = samples_with(fit, ReadingStatus::Used).len();
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
