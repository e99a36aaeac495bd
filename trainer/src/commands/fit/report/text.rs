//! The text of a report for the terminal.

use glimpse_trainer::measurement::MAX_SAMPLES;

use super::{FitReport, OutlierSummary, too_few};

/// The coefficient of variation of repeated readings above which one of them is probably wrong.
const MAX_PLAUSIBLE_SPREAD: f32 = 0.2;

impl FitReport {
    /// Formats the report for the terminal.
    pub(in super::super) fn to_text(&self, name: &str, keep_all: bool) -> String {
        let Self {
            recipe,
            measured,
            readings,
            ..
        } = self;
        let distance = match &measured.furthest {
            Some(distance) => format!(
                ", at most {:.2} degrees from their samples",
                distance.radians.to_degrees()
            ),
            None => String::new(),
        };
        let mut lines = vec![
            (
                "read",
                format!(
                    "{} of {} samples of {} in {} rows of {} ({}){distance}",
                    recipe.samples - readings.missing.len(),
                    recipe.samples,
                    recipe.file,
                    measured.rows,
                    measured.file,
                    measured.quantity_text,
                ),
            ),
            ("missing", describe_samples(&readings.missing)),
            ("saturated", self.saturated()),
            ("no light", self.no_light()),
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
            let status = match (
                readings.excluded_outliers.contains(&outlier.sample),
                keep_all,
            ) {
                (true, _) => "left out",
                (false, true) => "kept by --keep-all",
                (false, false) if recipe.takes_missing => "used",
                (false, false) => "used, since the recipe needs all readings: measure it again",
            };
            lines.push(("outlier", format!("{}; {status}", outlier.to_text())));
        }
        if recipe.samples > MAX_SAMPLES {
            let text = format!("not searched for, with more than {MAX_SAMPLES} samples");
            lines.push(("outliers", text));
        }
        lines.push(("used", format!("{} readings", readings.used)));
        if let Some(residual) = &self.residual {
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
        }
        lines.push((
            "expected loss",
            match &self.expected_loss {
                Some(expected) => expected.text.clone(),
                None if self.is_mostly_dark() => "unknown, since most readings are dark".to_owned(),
                None if too_few(readings.used, recipe.samples) => {
                    "unknown, since less than half of the readings are used".to_owned()
                }
                None => "not stated by the recipe".to_owned(),
            },
        ));
        let some = self
            .partial_scans
            .iter()
            .filter(|scan| scan.readings.is_power_of_two() || scan.readings == readings.used);
        let bounds: Vec<String> = some
            .map(|scan| format!("{:.4} ({})", scan.bound, scan.readings))
            .collect();
        if !bounds.is_empty() {
            let text = format!("{} after readings in the recipe's order", bounds.join(", "));
            lines.push(("early bounds", text));
        }
        let lines = lines.iter().filter(|(_, text)| !text.is_empty());
        let lines: String = lines
            .map(|(label, text)| format!("  {label:15}{text}\n"))
            .collect();
        format!("{name}\n{lines}")
    }

    /// Describes the saturated readings and their effect. Empty if there are none.
    fn saturated(&self) -> String {
        let list = &self.readings.saturated;
        let note = match self.recipe.takes_missing {
            _ if list.is_empty() => "",
            true => ", left out unless all readings are saturated",
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
