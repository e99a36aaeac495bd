//! The text of a report for the terminal.

use super::{FitReport, OutlierSummary, ReadingStatus, ReportEntry};

/// The coefficient of variation of repeated readings above which one of them is probably wrong.
const MAX_PLAUSIBLE_SPREAD: f32 = 0.2;

impl ReportEntry<'_> {
    /// Formats the report for the terminal.
    pub(in super::super) fn to_text(&self, keep_all: bool) -> String {
        let report = &self.report;
        let FitReport {
            recipe,
            measured,
            readings,
            ..
        } = report;
        let distance = match measured.furthest_degrees {
            Some(degrees) if degrees >= 0.005 => {
                format!(", at most {degrees:.2} degrees from their samples")
            }
            _ => String::new(),
        };
        let missing = readings.with_status(ReadingStatus::Missing);
        let mut lines = vec![
            (
                "read",
                format!(
                    "{} of {} samples of {} in {} rows of {} ({}){distance}",
                    recipe.samples - missing.len(),
                    recipe.samples,
                    recipe.file,
                    measured.rows,
                    measured.file,
                    measured.quantity,
                ),
            ),
            (
                "other recipe",
                recipe.reason.as_ref().map_or_else(String::new, |reason| {
                    format!("{} fits readings at any directions: {reason}", recipe.file)
                }),
            ),
            ("missing", describe_samples(&missing)),
            ("saturated", report.saturated()),
            ("no light", report.no_light()),
        ];
        if let (Some(spread), Some(sample)) = (readings.largest_spread, readings.most_spread) {
            let repeated = readings.repeated;
            let hint = match spread > MAX_PLAUSIBLE_SPREAD {
                true => ": one of its rows may be wrong",
                false => "",
            };
            let text = format!(
                "{repeated} samples; the largest standard deviation is {:.1} % of the mean, in sample \
                 {sample}{hint}",
                100.0 * spread
            );
            lines.push(("repeated", text));
        }
        for outlier in &readings.outliers {
            let note = match (outlier.status, keep_all) {
                (ReadingStatus::Used, true) => "used, by --keep-all",
                (ReadingStatus::Used, false) if recipe.takes_missing => "used",
                (ReadingStatus::Used, false) => {
                    "used, since the recipe needs all readings: measure it again"
                }
                _ => "not used",
            };
            lines.push(("outlier", format!("{}; {note}", outlier.to_text())));
        }
        lines.push(("used", format!("{} readings", readings.used)));
        let residual = &report.residual;
        lines.push((
            "residual",
            format!(
                "mean {:.4}, largest {:.4} at sample {}",
                residual.mean, residual.worst, residual.worst_index
            ),
        ));
        if let Some(reason) = residual.implausible {
            lines.push(("implausible", reason.text().to_owned()));
        }
        lines.push((
            "expected loss",
            match &report.expected_loss {
                Some(expected) => expected.text.clone(),
                None if report.is_mostly_dark() => {
                    "unknown, since most readings are dark".to_owned()
                }
                None => "unknown, since less than half of the readings are used".to_owned(),
            },
        ));
        if let Some(spectrum) = &report.spectrum {
            lines.push(("spectrum", spectrum.to_text()));
        }
        let lines = lines.iter().filter(|(_, text)| !text.is_empty());
        let lines: String = lines
            .map(|(label, text)| format!("  {label:15}{text}\n"))
            .collect();
        format!("{}\n{lines}", self.name)
    }
}

impl FitReport {
    /// Describes the saturated readings and their effect. Empty if there are none.
    fn saturated(&self) -> String {
        let list = &self.readings.saturated;
        let note = match self.recipe.takes_missing {
            _ if list.is_empty() => "",
            true => ", not used unless all readings are saturated",
            false => {
                ", too small, but the recipe needs all readings: measure again with less light"
            }
        };
        describe_samples(list) + note
    }

    /// Describes the readings without light. Empty if there are none.
    fn no_light(&self) -> String {
        let list = &self.readings.no_light;
        let note = match self.is_mostly_dark() {
            _ if list.is_empty() => "",
            true => ", 0 or below in all channels: check the lamp, --dark and --white",
            false => ", 0 or below in all channels",
        };
        describe_samples(list) + note
    }
}

impl OutlierSummary {
    fn to_text(&self) -> String {
        let rgb = |brdf: [f32; 3]| brdf.map(|f| format!("{f:.3}")).join(" ");
        format!(
            "sample {}: reading {}, predicted {} (z {:+.1}, threshold {:.1})",
            self.sample,
            rgb(self.reading),
            rgb(self.expected),
            self.z,
            self.threshold
        )
    }
}

/// Lists the numbers of samples; empty if there are none.
fn describe_samples(list: &[usize]) -> String {
    let names: Vec<String> = list.iter().map(usize::to_string).collect();
    match list.len() {
        0 => String::new(),
        1 => format!("sample {}", names.join(", ")),
        _ => format!("samples {}", names.join(", ")),
    }
}
