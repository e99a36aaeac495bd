//! Formats errors for the terminal. Settings are named by their command-line options.

use std::error::Error;

use glimpse_evaluation::conversion::ConversionError;
use glimpse_evaluation::evaluation::EvaluationError;
use glimpse_fitting::measurement::FitFailure;
use glimpse_materials::ShareError;
use glimpse_materials::setting::{Setting, SettingError};
use glimpse_training::meta::options::OptionsError;
use glimpse_training::route::{MachineError, PlanError};

/// Joins the messages of an error and its causes. A cause whose message is already included is omitted.
pub(crate) fn message(error: &anyhow::Error) -> String {
    let mut message = String::new();
    for cause in error.chain() {
        let cause = one_message(cause);
        if !message.contains(&cause) {
            let separator = if message.is_empty() { "" } else { ": " };
            message = message + separator + &cause;
        }
    }
    message
}

/// Returns the message of one error, in which settings are named by their options.
fn one_message(error: &(dyn Error + 'static)) -> String {
    fn with_options<E: SettingError + Error + 'static>(
        error: &(dyn Error + 'static),
    ) -> Option<String> {
        Some(error.downcast_ref::<E>()?.message(option))
    }
    with_options::<EvaluationError>(error)
        .or_else(|| with_options::<ShareError>(error))
        .or_else(|| with_options::<FitFailure>(error))
        .or_else(|| with_options::<OptionsError>(error))
        .or_else(|| with_options::<PlanError>(error))
        .or_else(|| with_options::<MachineError>(error))
        .or_else(|| with_options::<ConversionError>(error))
        .unwrap_or_else(|| error.to_string())
}

/// Returns the command-line option of a setting.
fn option(setting: Setting) -> String {
    match setting {
        Setting::Materials => "--data".to_owned(),
        other => format!("--{}", other.name().replace('_', "-")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_settings_by_options() {
        let error = anyhow::Error::from(EvaluationError::NeedsAllReadings).context("a.recipe");
        assert!(message(&error).contains("--missing"));
        let error = OptionsError::Range {
            setting: Setting::ScanSeconds,
            range: 0.0..=0.5,
            value: 0.75,
        };
        let plain = error.to_string();
        assert!(plain.contains("scan_seconds") && plain.contains("0.75"));
        assert!(message(&error.into()).contains("--scan-seconds"));
    }

    #[test]
    fn omits_repeated_cause() {
        let repeated = anyhow::anyhow!("cause").context("effect: cause");
        assert_eq!(message(&repeated), "effect: cause");
        let separate = anyhow::anyhow!("cause").context("effect");
        assert_eq!(message(&separate), "effect: cause");
    }
}
