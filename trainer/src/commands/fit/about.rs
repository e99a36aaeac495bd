//! The report on a fit: text for people, fields for programs and for `material.json`.

use std::path::Path;

use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Implausible, Residual};
use glimpse_trainer::measurement::{
    Distance, Examined, Fit, MOST_SAMPLES, Meaning, Measured, ReadingStatus, spread,
};
use serde::Serialize;

use super::super::expected_loss::{self, caution};
use crate::commit;

/// The spread of repeated readings, relative to their mean, from which on something is wrong with one.
const MUCH_SPREAD: f32 = 0.2;

/// What is known of a fit.
#[derive(Serialize)]
pub(super) struct About {
    trainer: &'static str,
    recipe: AboutRecipe,
    measured: AboutMeasured,
    readings: Readings,
    residual: Option<AboutResidual>,
    expected_loss: Option<ExpectedLoss>,
}

#[derive(Serialize)]
struct AboutRecipe {
    file: String,
    checksum: String,
    model: &'static str,
    samples: usize,
    takes_missing: bool,
}

#[derive(Serialize)]
struct AboutMeasured {
    /// The input, without the directories that lead to it.
    file: String,
    /// The quantity of its numbers, as a column `quantity` names it.
    quantity: &'static str,
    /// The same for people.
    #[serde(skip)]
    quantity_text: String,
    rows: usize,
    #[serde(skip)]
    furthest: Option<Distance>,
    /// How far a row was from its sample at most.
    furthest_degrees: Option<f64>,
}

#[derive(Serialize)]
struct Readings {
    /// How many the fit went by.
    used: usize,
    /// The others, by sample.
    excluded: Vec<Excluded>,
    missing: Vec<usize>,
    /// Whether the fit went by them or not.
    saturated: Vec<usize>,
    left_out: Vec<usize>,
    /// Where nothing above 0 was read, in no channel.
    no_light: Vec<usize>,
    /// How many were taken several times, and the largest of their spreads, relative to the value.
    repeated: usize,
    largest_spread: Option<f32>,
    /// The sample that has it.
    most_spread: Option<usize>,
    looks_wrong: Vec<LooksWrong>,
}

/// A sample whose reading the fit did not use.
#[derive(Serialize)]
struct Excluded {
    sample: usize,
    reason: ReadingStatus,
}

/// A reading that the others make improbable.
#[derive(Serialize)]
struct LooksWrong {
    sample: usize,
    z: f32,
    /// From what z on a reading looks wrong.
    limit: f32,
    /// BRDFs, sr^-1.
    read: [f32; 3],
    expected: [f32; 3],
}

#[derive(Serialize)]
struct AboutResidual {
    mean: f32,
    worst: f32,
    worst_index: u16,
    implausible: Option<Implausible>,
}

#[derive(Serialize)]
struct ExpectedLoss {
    loss: f32,
    source: LossSource,
    /// With [`LossSource::Validation`]: the standard error over the materials, if there were several.
    standard_error: Option<f32>,
    /// With [`LossSource::Validation`]: how many materials the loss is a mean over; 0 if that is not stated.
    materials: Option<u32>,
    /// The same for people.
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

/// What is known of a fit, and where it went, for machines.
#[derive(Serialize)]
pub(super) struct Named<'a> {
    name: &'a str,
    folder: String,
    #[serde(flatten)]
    about: &'a About,
}

impl About {
    /// Of a fit by a recipe whose file has this name.
    ///
    /// # Errors
    /// If what the recipe states about itself makes no sense.
    pub(super) fn new(
        recipe_file: String,
        recipe: &Recipe<'_>,
        input: &Path,
        meaning: &Meaning,
        measured: &Measured,
        fit: &Fit,
    ) -> anyhow::Result<Self> {
        let name = input.file_name().unwrap_or_default();
        let spreads = measured.samples.iter().enumerate();
        let spreads = spreads.filter_map(|(index, sample)| Some((index, spread(sample)?)));
        let most_spread = spreads.max_by(|(_, one), (_, other)| one.total_cmp(other));
        let mut about = Self {
            trainer: commit::VERSION,
            recipe: AboutRecipe {
                file: recipe_file,
                checksum: format!("{:08x}", recipe.checksum()),
                model: recipe.model().name(),
                samples: recipe.samples(),
                takes_missing: recipe.tolerates_missing(),
            },
            measured: AboutMeasured {
                file: name.to_string_lossy().into_owned(),
                quantity: meaning.name(),
                quantity_text: match meaning {
                    Meaning::Values(quantity) => quantity.to_string(),
                    Meaning::Counts(_) => "counts, by a white".to_owned(),
                },
                rows: measured.rows,
                furthest: measured.furthest,
                furthest_degrees: measured.furthest.map(|far| far.largest.to_degrees()),
            },
            readings: Readings {
                used: of(fit, ReadingStatus::Used).len(),
                excluded: excluded(fit),
                missing: of(fit, ReadingStatus::Missing),
                saturated: saturated(measured),
                left_out: of(fit, ReadingStatus::Excluded),
                no_light: no_light(measured),
                repeated: measured.samples.iter().filter(|s| s.count() > 1).count(),
                largest_spread: most_spread.map(|(_, spread)| spread),
                most_spread: most_spread.map(|(index, _)| index),
                looks_wrong: looks_wrong(measured, &fit.examined),
            },
            residual: fit.residual.map(|residual| {
                let Residual {
                    mean,
                    worst,
                    worst_index,
                    implausible,
                    ..
                } = residual;
                AboutResidual {
                    mean,
                    worst,
                    worst_index,
                    implausible,
                }
            }),
            expected_loss: expected_loss(recipe, fit)?,
        };
        // Training knows of materials that reflect light.
        if about.is_mostly_dark() {
            about.expected_loss = None;
        }
        Ok(about)
    }

    /// With the name of its material and its folder.
    pub(super) fn named<'a>(&'a self, name: &'a str, folder: &Path) -> Named<'a> {
        Named {
            name,
            folder: folder.display().to_string(),
            about: self,
        }
    }

    /// In words, line by line.
    pub(super) fn to_text(&self, name: &str, keep_all: bool) -> String {
        let Self {
            recipe,
            measured,
            readings,
            ..
        } = self;
        let far = match &measured.furthest {
            Some(far) => format!(
                ", none further off than {:.2} degrees",
                far.largest.to_degrees()
            ),
            None => String::new(),
        };
        let mut lines = vec![
            (
                "read",
                format!(
                    "{} of {} samples of {} in {} rows of {} ({}){far}",
                    recipe.samples - readings.missing.len(),
                    recipe.samples,
                    recipe.file,
                    measured.rows,
                    measured.file,
                    measured.quantity_text,
                ),
            ),
            ("missing", samples(&readings.missing)),
            ("saturated", self.saturated()),
            ("no light", self.no_light()),
        ];
        if let (Some(spread), Some(sample)) = (readings.largest_spread, readings.most_spread) {
            let repeated = readings.repeated;
            let look = match spread > MUCH_SPREAD {
                true => ": look at its rows, one may be wrong",
                false => "",
            };
            let text = format!(
                "in {repeated} of the samples, spread by {:.1} % at most, in sample {sample}{look}",
                100.0 * spread
            );
            lines.push(("repeated", text));
        }
        for wrong in &readings.looks_wrong {
            let why = match (readings.left_out.contains(&wrong.sample), keep_all) {
                (true, _) => "left out",
                (false, true) => "kept by --keep-all",
                (false, false) if recipe.takes_missing => "and it was not left out",
                (false, false) => "and the recipe cannot do without: read it again",
            };
            lines.push(("looks wrong", format!("{}, {why}", wrong.to_text())));
        }
        if recipe.samples > MOST_SAMPLES {
            let text = format!("no reading was looked at, of more than {MOST_SAMPLES} samples");
            lines.push(("looks wrong", text));
        }
        lines.push(("used", format!("{} readings", readings.used)));
        if let Some(residual) = &self.residual {
            lines.push((
                "residual",
                format!(
                    "{:.4} at the readings, the largest {:.4} at sample {}",
                    residual.mean, residual.worst, residual.worst_index
                ),
            ));
            if let Some(reason) = residual.implausible {
                lines.push(("implausible", reason.to_string()));
            }
        }
        lines.push((
            "expected loss",
            match &self.expected_loss {
                Some(expected) => expected.text.clone(),
                None if self.is_mostly_dark() => "not known, as most readings are dark".to_owned(),
                None if too_few(readings.used, recipe.samples) => {
                    "not known from so few readings".to_owned()
                }
                None => "not stated by the recipe".to_owned(),
            },
        ));
        let lines = lines.iter().filter(|(_, text)| !text.is_empty());
        let lines: String = lines
            .map(|(what, text)| format!("  {what:15}{text}\n"))
            .collect();
        format!("{name}\n{lines}")
    }
}

impl About {
    /// Which readings are saturated, in words, and what comes of it.
    fn saturated(&self) -> String {
        let list = &self.readings.saturated;
        let what = match self.recipe.takes_missing {
            _ if list.is_empty() => "",
            true => ", left out if others are not",
            false => ", too small, and the recipe cannot do without: read again with less light",
        };
        samples(list) + what
    }

    /// Which readings have no light, in words, and what is to be looked at.
    fn no_light(&self) -> String {
        let list = &self.readings.no_light;
        let what = match self.is_mostly_dark() {
            _ if list.is_empty() => "",
            true => ", nothing above 0: is the lamp on, and are --dark and --white right?",
            false => ", nothing above 0",
        };
        samples(list) + what
    }

    /// Whether most of what was read has no light.
    fn is_mostly_dark(&self) -> bool {
        let read = self.recipe.samples - self.readings.missing.len();
        2 * self.readings.no_light.len() > read
    }
}

/// Samples where nothing above 0 was read.
fn no_light(measured: &Measured) -> Vec<usize> {
    let all = measured.samples.iter().enumerate();
    let dark = all.filter(|(_, sample)| {
        let mean = sample.mean();
        mean.is_some_and(|mean| mean.into_iter().all(|value| value <= 0.0))
    });
    dark.map(|(index, _)| index).collect()
}

/// Samples with a saturated reading.
fn saturated(measured: &Measured) -> Vec<usize> {
    let all = measured.samples.iter().enumerate();
    let saturated = all.filter(|(_, sample)| sample.saturated());
    saturated.map(|(index, _)| index).collect()
}

/// True if a fit goes by less than half of the readings: then neither what a recipe predicts nor what it
/// promises is known to hold.
fn too_few(used: usize, samples: usize) -> bool {
    2 * used < samples
}

impl LooksWrong {
    fn to_text(&self) -> String {
        let rgb = |brdf: [f32; 3]| brdf.map(|f| format!("{f:.3}")).join(" ");
        format!(
            "sample {}: read {}, expected about {} (z {:+.1}, wrong from {:.1})",
            self.sample,
            rgb(self.read),
            rgb(self.expected),
            self.z,
            self.limit
        )
    }
}

/// The samples that the fit did not use, each with the reason.
fn excluded(fit: &Fit) -> Vec<Excluded> {
    let all = fit.fates.iter().enumerate();
    let others = all.filter(|(_, fate)| **fate != ReadingStatus::Used);
    others
        .map(|(sample, reason)| Excluded {
            sample,
            reason: *reason,
        })
        .collect()
}

fn of(fit: &Fit, fate: ReadingStatus) -> Vec<usize> {
    let all = fit.fates.iter().enumerate();
    let such = all.filter(|(_, found)| **found == fate);
    such.map(|(index, _)| index).collect()
}

/// Numbers of samples in words; empty if there are none.
fn samples(list: &[usize]) -> String {
    let names: Vec<String> = list.iter().map(usize::to_string).collect();
    match list.len() {
        0 => String::new(),
        1 => format!("sample {}", names.join(", ")),
        _ => format!("samples {}", names.join(", ")),
    }
}

fn looks_wrong(measured: &Measured, examined: &Examined) -> Vec<LooksWrong> {
    let suspects = examined.suspects.iter().map(|suspect| LooksWrong {
        sample: suspect.sample,
        z: suspect.opinion.z as f32,
        limit: examined.limit as f32,
        read: measured.samples[suspect.sample].mean().unwrap_or_default(),
        expected: suspect.opinion.expected,
    });
    suspects.collect()
}

/// What the recipe predicts from these readings, or else what it promises.
fn expected_loss(recipe: &Recipe<'_>, fit: &Fit) -> anyhow::Result<Option<ExpectedLoss>> {
    if too_few(of(fit, ReadingStatus::Used).len(), recipe.samples()) {
        return Ok(None);
    }
    if let Some(loss) = fit.predicted_loss {
        let caution = caution(recipe)?.map_or_else(String::new, |caution| format!(", {caution}"));
        return Ok(Some(ExpectedLoss {
            loss,
            source: LossSource::Readings,
            standard_error: None,
            materials: None,
            text: format!("{loss:.4}, as the recipe predicts from these readings{caution}"),
        }));
    }
    let stated = recipe.metadata()?.expectation;
    Ok(stated
        .zip(expected_loss::expected_loss(recipe)?)
        .map(|(stated, promise)| ExpectedLoss {
            loss: stated.loss,
            source: LossSource::Validation,
            standard_error: stated.standard_error,
            materials: Some(stated.materials),
            text: format!("as the recipe promises, {promise}"),
        }))
}
