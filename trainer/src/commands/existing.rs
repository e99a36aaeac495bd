//! The file at a recipe's path: nothing, the recipe of the same training, or another file.

use std::path::Path;

use glimpse_core::model::ModelKind;
use glimpse_materials::basis::Basis;
use glimpse_materials::files::is_stream;
use glimpse_training::meta::options::Options;
use glimpse_training::recipe::{RecipeFile, describe_options, describe_training};

/// The file at a recipe's path before training.
pub(super) enum Existing {
    /// No recipe.
    Nothing,
    /// The recipe that training would write, with its expected loss.
    Done(f32),
    /// Another file, described for people.
    Other(String),
}

/// Examines the path of a recipe before training. The digest of the options decides whether the file is
/// the recipe that training would write; `data` names the materials in messages.
pub(super) fn existing_at(out: &Path, options: &Options, data: &str) -> Existing {
    // A pipe or a device does not hold a recipe, and may not end.
    if !out.exists() || is_stream(out) {
        return Existing::Nothing;
    }
    let file = match RecipeFile::read(out) {
        Ok(file) => file,
        Err(error) => return Existing::Other(error.to_string()),
    };
    let (recipe, statements) = (file.recipe(), file.metadata());
    let (Some(training), Some(provenance), Some(expectation)) = (
        statements.training,
        statements.provenance,
        statements.expectation,
    ) else {
        return Existing::Other(format!(
            "{} does not state how it was trained",
            out.display()
        ));
    };
    let has_basis = recipe.model() != ModelKind::Linear || Basis::beside(out).exists();
    match training.digest == options.digest() {
        true if has_basis => Existing::Done(expectation.loss),
        true => Existing::Other(format!("{} lacks its basis", out.display())),
        false => {
            let (model, samples) = (recipe.model(), recipe.samples());
            Existing::Other(format!(
                "{} was trained with other options ({}, not {})",
                out.display(),
                describe_training(model, samples, &provenance, training.digest),
                describe_options(options, data)
            ))
        }
    }
}

#[cfg(test)]
mod tests {
    use glimpse_core::recipe::{Kind, ValidationSplit};
    use glimpse_materials::sampling::sobol_valid;
    use glimpse_materials::{Portion, Source};
    use glimpse_training::meta::learned::{Learned, LearnedDescent, LearnedFit, ValidatedLoss};
    use glimpse_training::meta::objective::Expected;
    use glimpse_training::meta::plan::{Effort, Schedule};
    use glimpse_training::recipe::recipe_of;

    use super::super::output::write_file_forced;
    use super::*;

    fn options() -> Options {
        Options {
            portions: vec![Portion::whole(&Source("MERL".into()), 12)],
            ..Options::new(ModelKind::Phong, 2, Schedule::Prior, Effort::Quick, 0)
        }
    }

    fn recipe(options: &Options, data: &str) -> RecipeFile {
        let learned = Learned {
            pattern: sobol_valid(2, 0),
            fit: LearnedFit::Descent(LearnedDescent {
                model: ModelKind::Phong,
                inner_steps: 1,
                initial: vec![0.5; 7],
                step_sizes: vec![0.5; 7],
            }),
            prediction: None,
            basis: None,
            expected_loss: ValidatedLoss {
                expected: Expected::new(0.25, [0.25; 2].into_iter()),
                split: ValidationSplit::Folds,
            },
            materials: Vec::new(),
        };
        recipe_of(&learned, options, data).expect("it is a recipe")
    }

    #[test]
    fn the_digest_decides_and_no_text_does() {
        let scratch = tempfile::tempdir().expect("a temporary directory");
        let out = scratch.path().join("phong.recipe");
        assert!(matches!(
            existing_at(&out, &options(), ""),
            Existing::Nothing
        ));

        // The texts of the provenance differ, and the options do not.
        write_file_forced(&out, recipe(&options(), "other words").bytes(), true)
            .expect("it is written");
        let existing = existing_at(&out, &options(), "MERL");
        assert!(matches!(existing, Existing::Done(loss) if loss == 0.25));

        let changes: [fn(&mut Options); 4] = [
            |o| o.seed = 1,
            |o| o.completion_options.limits.min_separation = 0.001,
            |o| o.portions[0].materials = 13,
            |o| o.parts = glimpse_training::meta::options::Parts::AllTwice,
        ];
        for change in changes {
            let mut other = options();
            change(&mut other);
            let Existing::Other(message) = existing_at(&out, &other, "MERL") else {
                panic!("another training is taken for this one");
            };
            for digest in [options().digest(), other.digest()] {
                assert!(message.contains(&format!("{digest:016x}")), "{message}");
            }
        }
        // One that does not state its options may be anything.
        let stated = recipe(&options(), "MERL");
        let mut buffer = vec![0; stated.bytes().len()];
        let silent = stated
            .recipe()
            .copy_without(&[Kind::TRAINING], &mut buffer)
            .expect("a copy");
        write_file_forced(&out, silent, true).expect("it is written");
        let existing = existing_at(&out, &options(), "MERL");
        assert!(matches!(existing, Existing::Other(_)));
    }
}
