//! The report on a fit for `--json` and the terminal.

use clap::ValueEnum;
use glimpse_fitting::choice::Choice;
use glimpse_fitting::measurement::{
    ColumnSummary, FitReport, GlossGap, InputSummary, NoiseSummary, OutlierKind, Role,
    SpectrumReading, SpectrumReport,
};
use glimpse_materials::COLOR_BANDS;
use serde::Serialize;

use super::super::expected_loss::with_scale;
use super::super::formats::WrittenFormat;
use crate::report::Table;

/// The coefficient of variation of repeated readings above which one of them is probably wrong.
const MAX_PLAUSIBLE_SPREAD: f32 = 0.2;

/// An entry of `--json`: a report with the material's name and folder.
#[derive(Serialize)]
pub(super) struct ReportEntry<'a> {
    pub(super) name: &'a str,
    pub(super) folder: String,
    /// The files of --format.
    pub(super) formats: Vec<WrittenFormat>,
    #[serde(flatten)]
    pub(super) report: FitReport,
    /// The reason that the given recipe does not fit the readings.
    #[serde(skip)]
    pub(super) off_pattern: Option<String>,
    /// A caution about the recipe's losses.
    #[serde(skip)]
    pub(super) caution: Option<String>,
}

impl ReportEntry<'_> {
    /// Formats the report for the terminal.
    pub(super) fn to_text(&self) -> anyhow::Result<String> {
        let FitReport {
            recipe,
            measured,
            readings,
            residual,
            ..
        } = &self.report;
        let distance = match measured.furthest_degrees {
            Some(degrees) if degrees >= 0.005 => {
                format!(", at most {degrees:.2} degrees from their samples")
            }
            _ => String::new(),
        };
        let missing = readings.missing();
        let read = format!(
            "{} of {} samples of {} in {} rows of {} ({}){distance}",
            recipe.samples - missing.len(),
            recipe.samples,
            recipe.file,
            measured.rows,
            measured.file,
            measured.quantity,
        );
        let mut lines: Vec<_> = self
            .report
            .doubt
            .iter()
            .map(|doubt| ("question", doubt.to_string()))
            .collect();
        lines.push(("read", read));
        lines.push(("columns", describe_columns(measured)));
        lines.extend(measured.cielab.map(|viewing| {
            let (illuminant, observer) = (viewing.illuminant.name(), viewing.observer.name());
            ("CIELAB", format!("{illuminant}, {observer} degrees"))
        }));
        if let Some(reason) = &self.off_pattern {
            let text = format!("{} fits readings at any directions: {reason}", recipe.file);
            lines.push(("other recipe", text));
        }
        let saturated_note = if recipe.takes_missing {
            "not used unless all readings are saturated"
        } else {
            "too small, but the recipe needs all readings: measure again with less light"
        };
        let dark_note = if self.report.is_mostly_dark() {
            "0 or below in all channels: check the lamp, --dark and --white"
        } else {
            "0 or below in all channels"
        };
        let mut notes = vec![
            ("missing", missing, ""),
            ("saturated", readings.saturated.clone(), saturated_note),
            ("no light", readings.no_light.clone(), dark_note),
        ];
        for kind in OutlierKind::value_variants() {
            let note = match kind {
                OutlierKind::Single => "unlike the others: check it",
                OutlierKind::Neighbors => "unlike the others together: check them",
                OutlierKind::Clipped => "at the largest number: flag them in a column saturated",
                OutlierKind::NoLight | OutlierKind::Obstructed => {
                    "unlike the others: remove rows where lamp and sensor are in each other's way"
                }
            };
            let outliers = readings.outliers.iter().filter(|one| one.kind == *kind);
            let samples = outliers.map(|one| one.sample).collect();
            notes.push(("outliers", samples, note));
        }
        for (label, samples, note) in notes {
            if !samples.is_empty() {
                let separator = if note.is_empty() { "" } else { ", " };
                let samples: Vec<String> = samples.iter().map(usize::to_string).collect();
                lines.push((label, samples.join(", ") + separator + note));
            }
        }
        if let (Some(spread), Some(sample)) = (readings.largest_spread, readings.most_spread) {
            let hint = if spread > MAX_PLAUSIBLE_SPREAD {
                ": one of its rows may be wrong"
            } else {
                ""
            };
            let text = format!(
                "{} samples; the largest standard deviation is {:.1} % of the mean, in sample {sample}{hint}",
                readings.repeated,
                100.0 * spread
            );
            lines.push(("repeated", text));
        }
        lines.push(("used", format!("{} readings", readings.used)));
        lines.extend(self.report.noise.map(|NoiseSummary { source, largest }| {
            let (percent, source) = (100.0 * largest, source.name());
            (
                "noise",
                format!("at most {percent:.1} % of a reading ({source}: see --noise)"),
            )
        }));
        let text = format!(
            "mean {:.4}, largest {:.4} at sample {}",
            residual.mean, residual.worst, residual.worst_index
        );
        lines.push(("residual", text));
        if let Some(reason) = residual.implausible {
            lines.push(("implausible", reason.text().to_owned()));
        }
        lines.push(("expected loss", self.expected_loss()));
        lines.extend(self.describe_gaps());
        if let Some(spectrum) = &self.report.spectrum {
            lines.push(("spectrum", describe_spectrum(spectrum)));
        }
        let lines = lines.iter();
        let lines = lines.map(|(label, text)| format!("  {label:15}{text}\n"));
        let text = format!("{}\n{}", self.name, lines.collect::<String>());
        if readings.outliers.is_empty() {
            return Ok(text);
        }
        let table = Table::of_records("outliers", &readings.outliers)?;
        Ok(format!("{text}\n{}", table.to_markdown()))
    }

    fn expected_loss(&self) -> String {
        let Some(expected) = self.report.expected_loss else {
            let reason = if self.report.is_mostly_dark() {
                "most readings are dark"
            } else {
                "less than half of the readings are used"
            };
            return format!("unknown, since {reason}");
        };
        let mut text = with_scale(expected.loss, expected.bound, &self.report.loss_scale);
        text += ", predicted from these readings";
        if expected.unlike_training == Some(true) {
            text += "; the readings are unlike those of all training materials, so the loss may be larger";
        }
        if let Some(caution) = &self.caution {
            text += &format!("; {caution}");
        }
        text
    }

    /// Returns lines about what the readings leave open.
    fn describe_gaps(&self) -> impl Iterator<Item = (&'static str, String)> {
        let gaps = &self.report.gaps;
        let gloss = gaps.gloss.as_ref().map(|GlossGap { nearest, read }| {
            format!(
                "a guess: the reading nearest to the mirror direction is {nearest:.0} degrees off; read theta_i = theta_o of \
                 {read:.0?} degrees at phi_o - phi_i of 180"
            )
        });
        let beyond = gaps.extrapolated_from;
        let beyond = beyond.map(|from| format!("from {from:.0} degrees on, for light and sensor"));
        let next = gaps.next.and_then(|next| {
            let arms = next.arms?;
            let (theta_i, theta_o) = (arms.theta_i?, arms.theta_o?);
            let phi = arms.phi_o.map(|phi| format!(", phi_o - phi_i {phi:.1}"));
            let phi = phi.unwrap_or_default();
            Some(format!(
                "theta_i {theta_i:.1}, theta_o {theta_o:.1}{phi} degrees helps most: expected loss {:.4}, \
                 at most {:.4}",
                next.expected_loss, next.bound
            ))
        });
        let width =
            "its width is not known; read gloss, or within 15 degrees of the mirror direction";
        let color = "unknown: there is one channel".to_owned();
        let lines = [
            ("gloss", gloss),
            ("highlight", gaps.is_width_unknown.then(|| width.to_owned())),
            ("extrapolated", beyond),
            ("color", gaps.is_monochrome.then_some(color)),
            ("next reading", next),
        ];
        let lines = lines.into_iter();
        lines.filter_map(|(label, text)| Some((label, text?)))
    }
}

/// Returns the meaning of the columns, and the rows that were left out.
fn describe_columns(measured: &InputSummary) -> String {
    let mut groups: Vec<(&ColumnSummary, Vec<&str>)> = Vec::new();
    for column in &measured.table.columns {
        let mut same = groups.iter_mut();
        match same.find(|(first, _)| first.role == column.role && first.unit == column.unit) {
            Some((_, names)) => names.push(&column.name),
            None => groups.push((column, vec![&column.name])),
        }
    }
    let columns = groups.iter().map(|(first, names)| {
        let names = match names[..] {
            [first, _, _, _, .., last] => format!("{first}, ..., {last}"),
            _ => names.join(", "),
        };
        let unit = first
            .unit
            .as_ref()
            .map_or(String::new(), |unit| format!(" ({unit})"));
        let unused = first.role == Role::Exposure && measured.quantity != "counts";
        let unused = if unused { ", not used" } else { "" };
        format!("{names}: {}{unit}{unused}", first.role.name())
    });
    let left_out = measured.table.left_out.iter();
    let left_out =
        left_out.map(|(reason, rows)| format!("{rows} rows left out: {}", reason.name()));
    columns.chain(left_out).collect::<Vec<_>>().join("; ")
}

fn describe_spectrum(report: &SpectrumReport) -> String {
    let bands = format!(
        "{} bands, {} to {} nm",
        report.wavelengths.len(),
        report.wavelengths.first().unwrap_or(&0.0),
        report.wavelengths.last().unwrap_or(&0.0),
    );
    let (Some(illuminant), Some(observer)) = (&report.illuminant, &report.observer) else {
        return format!("{bands}; no colors and no sphere.png, which need {COLOR_BANDS}");
    };
    let delta_e = |reading: &SpectrumReading| reading.delta_e.unwrap_or(0.0);
    let sum: f64 = report.readings.iter().map(delta_e).sum();
    let mean = sum / report.readings.len().max(1) as f64;
    let worst = report.readings.iter();
    let worst = worst.max_by(|one, other| delta_e(one).total_cmp(&delta_e(other)));
    let worst = worst.map_or(String::new(), |worst| {
        format!(
            ", largest {:.2} at sample {} ({:.0} degrees from the mirror direction)",
            delta_e(worst),
            worst.sample,
            worst.aspecular
        )
    });
    format!(
        "{bands}; color error (CIEDE2000, {}, {observer} degrees) mean {mean:.2}{worst}",
        illuminant.to_uppercase(),
    )
}
