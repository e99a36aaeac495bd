//! Check of a recipe's output path before training: no file, the recipe of the same training, or another file.

use std::path::Path;

use glimpse_core::model::ModelKind;
use glimpse_materials::basis::Basis;
use glimpse_materials::files::is_stream;
use glimpse_training::meta::options::Options;
use glimpse_training::recipe::{RecipeFile, Training};

/// The file at a recipe's path before training.
pub(super) enum ExistingOutput {
    /// No file, or a pipe or device.
    Missing,
    /// The recipe that training would write, with its expected loss.
    Trained(f32),
    /// Another file, with a description.
    Conflict(String),
}

/// Examines the path of a recipe before training. The digest of the options decides whether the file is
/// the recipe that training would write; `data` names the materials in messages.
pub(super) fn existing_output(out: &Path, options: &Options, data: &str) -> ExistingOutput {
    // A pipe or a device holds no recipe, and reading it may never end.
    if !out.exists() || is_stream(out) {
        return ExistingOutput::Missing;
    }
    let file = match RecipeFile::read(out) {
        Ok(file) => file,
        Err(error) => return ExistingOutput::Conflict(error.to_string()),
    };
    let recipe = file.recipe();
    let training = file.metadata().training.as_ref();
    let Some((training, expected_loss)) = training.zip(recipe.expected_loss()) else {
        return ExistingOutput::Conflict(format!(
            "{} does not state its training options",
            out.display()
        ));
    };
    let has_basis = recipe.model() != ModelKind::Linear || Basis::path_for(out).exists();
    match training.digest == options.digest() {
        true if has_basis => ExistingOutput::Trained(expected_loss),
        true => ExistingOutput::Conflict(format!(
            "{} has no basis file {}",
            out.display(),
            Basis::path_for(out).display()
        )),
        false => {
            let (model, samples) = (recipe.model(), recipe.samples());
            let shares = options.source_shares.iter();
            let materials = shares.map(|each| each.materials).sum();
            let requested = Training::new(options, data, materials);
            ExistingOutput::Conflict(format!(
                "{} was trained with other options (in the file: {}; in this command: {})",
                out.display(),
                training.describe(model, samples),
                requested.describe(options.model, options.samples)
            ))
        }
    }
}

#[cfg(test)]
mod tests {
    use glimpse_materials::sampling::sobol_valid;
    use glimpse_materials::{Source, SourceShare};
    use glimpse_training::meta::learned::{
        LearnedFit, LearnedRecipe, LearnedSgd, ValidatedLoss, ValidationSplit,
    };
    use glimpse_training::meta::objective::LossEstimate;
    use glimpse_training::meta::plan::{Effort, Schedule};
    use glimpse_training::recipe::pack_recipe;

    use super::super::output::write_file;
    use super::*;

    fn options() -> Options {
        Options {
            source_shares: vec![SourceShare::single(&Source("MERL".into()), 12)],
            ..Options::new(ModelKind::Phong, 2, Schedule::Prior, Effort::Quick, 0)
        }
    }

    fn recipe(options: &Options, data: &str) -> RecipeFile {
        let learned = LearnedRecipe {
            pattern: sobol_valid(2, 0),
            fit: LearnedFit::Sgd(LearnedSgd {
                model: ModelKind::Phong,
                steps: 1,
                initial: vec![0.5; 7],
                step_sizes: vec![0.5; 7],
            }),
            loss_predictor: None,
            basis: None,
            expected_loss: ValidatedLoss {
                estimate: LossEstimate::new(0.25, [0.25; 2].into_iter()),
                split: ValidationSplit::Folds,
            },
            materials: Vec::new(),
        };
        pack_recipe(&learned, options, data).expect("a valid recipe")
    }

    #[test]
    fn digest_identifies_training() {
        let scratch = tempfile::tempdir().expect("a temporary directory");
        let out = scratch.path().join("phong.recipe");
        assert!(matches!(
            existing_output(&out, &options(), ""),
            ExistingOutput::Missing
        ));

        // The names of the materials differ, but the options are the same.
        write_file(&out, recipe(&options(), "other words").bytes(), true)
            .expect("the recipe is written");
        let existing = existing_output(&out, &options(), "MERL");
        assert!(matches!(existing, ExistingOutput::Trained(loss) if loss == 0.25));

        let changes: [fn(&mut Options); 4] = [
            |o| o.seed = 1,
            |o| o.completion_options.limits.min_separation = 0.001,
            |o| o.source_shares[0].materials = 13,
            |o| o.parts = glimpse_training::meta::plan::TrainedParts::AllTwice,
        ];
        for change in changes {
            let mut other = options();
            change(&mut other);
            let ExistingOutput::Conflict(message) = existing_output(&out, &other, "MERL") else {
                panic!("other options are not detected");
            };
            for digest in [options().digest(), other.digest()] {
                assert!(message.contains(&format!("{digest:016x}")), "{message}");
            }
        }
        // A recipe without metadata is a conflict.
        let stripped = recipe(&options(), "MERL").stripped().expect("a copy");
        write_file(&out, stripped.bytes(), true).expect("the recipe is written");
        let existing = existing_output(&out, &options(), "MERL");
        assert!(matches!(existing, ExistingOutput::Conflict(_)));
    }
}
