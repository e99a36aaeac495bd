//! Formats errors for the terminal. Settings are named by their command-line options.

use std::error::Error;

use glimpse_materials::ShareError;
use glimpse_materials::setting::{Setting, SettingError};
use glimpse_trainer::evaluation::EvaluationError;
use glimpse_trainer::measurement::FitFailure;
use glimpse_training::meta::options::CompletionOptionsError;

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
        .or_else(|| with_options::<CompletionOptionsError>(error))
        .unwrap_or_else(|| error.to_string())
}

/// Returns the command-line option of a setting.
fn option(setting: Setting) -> &'static str {
    match setting {
        Setting::Additive => "--additive",
        Setting::Materials => "--data",
        Setting::MaxThetaI => "--max-theta-i",
        Setting::MaxThetaO => "--max-theta-o",
        Setting::Method => "--method",
        Setting::MinSeparation => "--min-separation",
        Setting::Missing => "--missing",
        Setting::Noise => "--noise",
        Setting::Procedural => "--procedural",
        Setting::Recipe => "--recipe",
        Setting::Schedule => "--schedule",
        Setting::Share => "--share",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_settings_by_options() {
        let error = anyhow::Error::from(EvaluationError::NeedsAllReadings).context("a.recipe");
        assert!(message(&error).contains("--missing"));
        let error = CompletionOptionsError::Range {
            field: Setting::MinSeparation,
            max: 0.5,
            value: 0.75,
        };
        let plain = error.to_string();
        assert!(plain.contains("min_separation") && plain.contains("0.75"));
        assert!(message(&error.into()).contains("--min-separation"));
    }

    #[test]
    fn omits_repeated_cause() {
        let repeated = anyhow::anyhow!("cause").context("effect: cause");
        assert_eq!(message(&repeated), "effect: cause");
        let separate = anyhow::anyhow!("cause").context("effect");
        assert_eq!(message(&separate), "effect: cause");
    }
}
