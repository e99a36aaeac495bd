//! Check of a recipe's output path before training: it must be free, or hold the recipe of the same training.

use std::fmt::Display;
use std::path::Path;

use anyhow::anyhow;
use glimpse_core::model::ModelKind;
use glimpse_materials::basis::Basis;
use glimpse_materials::files::is_stream;
use glimpse_training::meta::options::Options;
use glimpse_training::recipe::{RecipeFile, Training};

/// Returns the expected loss of the recipe at `out` if it is of this training already; None if the path is free, or
/// leads to a pipe or device. The digest of the options decides; `data` names the materials in messages.
///
/// # Errors
/// If another file is at `out`.
pub(super) fn trained_loss(
    out: &Path,
    options: &Options,
    data: &str,
) -> anyhow::Result<Option<f32>> {
    // A pipe or a device holds no recipe, and reading it may never end.
    if !out.exists() || is_stream(out) {
        return Ok(None);
    }
    let refuse = |description: &dyn Display| {
        anyhow!("{description}: give --force to replace it, or another --out")
    };
    let file = RecipeFile::read(out).map_err(|error| refuse(&error))?;
    let (recipe, path) = (file.recipe(), out.display());
    let training = file.metadata().training.as_ref();
    let Some((training, expected_loss)) = training.zip(recipe.expected_loss()) else {
        let unstated = format!("{path} does not state its training options");
        return Err(refuse(&unstated));
    };
    if training.digest != options.digest() {
        let materials = options.source_shares.iter().map(|each| each.materials);
        let requested = Training::new(options, data, materials.sum());
        return Err(refuse(&format!(
            "{path} was trained with other options (in the file: {}; in this command: {})",
            training.describe(recipe.model(), recipe.samples()),
            requested.describe(options.model, options.samples)
        )));
    }
    let basis = Basis::path_for(out);
    if recipe.model() == ModelKind::Linear && !basis.exists() {
        let missing = format!("{path} has no basis file {}", basis.display());
        return Err(refuse(&missing));
    }
    Ok(Some(expected_loss))
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
        let trained = trained_loss(&out, &options(), "");
        assert_eq!(trained.expect("no file"), None);

        // The names of the materials differ, but the options are the same.
        write_file(&out, recipe(&options(), "other words").bytes(), true)
            .expect("the recipe is written");
        let trained = trained_loss(&out, &options(), "MERL");
        assert_eq!(trained.expect("the same training"), Some(0.25));

        let changes: [fn(&mut Options); 4] = [
            |o| o.seed = 1,
            |o| o.completion_options.limits.min_separation = 0.001,
            |o| o.source_shares[0].materials = 13,
            |o| o.parts = glimpse_training::meta::plan::TrainedParts::AllTwice,
        ];
        for change in changes {
            let mut other = options();
            change(&mut other);
            let error = trained_loss(&out, &other, "MERL").expect_err("other options");
            let message = error.to_string();
            for digest in [options().digest(), other.digest()] {
                assert!(message.contains(&format!("{digest:016x}")), "{message}");
            }
        }
        // A recipe without metadata is a conflict.
        let stripped = recipe(&options(), "MERL").stripped().expect("a copy");
        write_file(&out, stripped.bytes(), true).expect("the recipe is written");
        assert!(trained_loss(&out, &options(), "MERL").is_err());
    }
}
