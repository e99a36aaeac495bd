//! Errors in words, with the names of the command line.

use std::error::Error;

use glimpse_materials::ShareError;
use glimpse_materials::setting::{NamesSettings, Setting};
use glimpse_trainer::evaluation::EvaluationError;
use glimpse_trainer::measurement::FitFailure;
use glimpse_training::meta::options::CompletionOptionsError;

/// An error and its causes, those left out that the one before has said already.
pub(crate) fn message(error: &anyhow::Error) -> String {
    let mut message = String::new();
    for cause in error.chain() {
        let cause = sentence(cause);
        if !message.contains(&cause) {
            let joint = if message.is_empty() { "" } else { ": " };
            message = message + joint + &cause;
        }
    }
    message
}

/// The message of one error, which names settings by their options.
fn sentence(error: &(dyn Error + 'static)) -> String {
    fn with_options<E: NamesSettings + Error + 'static>(
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

/// The option of a setting.
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
    fn settings_are_named_by_their_options() {
        let error = anyhow::Error::from(EvaluationError::NeedsAll).context("a.recipe");
        assert!(message(&error).contains("--missing"));
        let error = CompletionOptionsError::Range {
            field: Setting::MinSeparation,
            most: 0.5,
            value: 0.75,
        };
        let plain = error.to_string();
        assert!(plain.contains("min_separation") && plain.contains("0.75"));
        assert!(message(&error.into()).contains("--min-separation"));
    }

    #[test]
    fn a_cause_is_told_once() {
        let told = anyhow::anyhow!("cause").context("effect: cause");
        assert_eq!(message(&told), "effect: cause");
        let untold = anyhow::anyhow!("cause").context("effect");
        assert_eq!(message(&untold), "effect: cause");
    }
}
