//! Stored recipes and evaluations, and their files.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use glimpse_materials::basis::Basis;
use glimpse_materials::files::write_atomic;
use glimpse_trainer::evaluation::{MaterialMetrics, Report};
use glimpse_trainer::metrics::Metrics;
use glimpse_training::recipe::RecipeFile;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// A trained recipe, and its basis if the model is Linear.
pub(crate) struct TrainedRecipe {
    pub(crate) file: RecipeFile,
    pub(crate) basis: Option<Basis>,
}

/// The evaluation of a method, as it is stored.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Evaluation {
    /// Means over the materials.
    #[serde(flatten)]
    pub(crate) metrics: Metrics,
    /// Number of seeds in the means.
    pub(crate) seeds: u64,
    /// Standard deviation of the mean loss between seeds.
    pub(crate) loss_spread: f64,
    /// Metrics of each material.
    pub(crate) materials: Vec<MaterialMetrics>,
}

impl From<Report> for Evaluation {
    fn from(report: Report) -> Self {
        let Report {
            metrics,
            seeds,
            loss_spread,
            materials,
            ..
        } = report;
        Self {
            metrics,
            seeds,
            loss_spread,
            materials,
        }
    }
}

impl TrainedRecipe {
    /// Combines a recipe's file with the bytes of its basis.
    pub(super) fn new(file: RecipeFile, basis: Option<&[u8]>) -> anyhow::Result<Self> {
        let basis = basis
            .map(Basis::from_bytes)
            .transpose()
            .map_err(|error| anyhow!("the recipe's basis: {error}"))?;
        Ok(Self { file, basis })
    }
}

/// Appends an extension to a path, without replacing an existing extension.
pub(super) fn append_extension(path: &Path, extension: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".");
    name.push(extension);
    name.into()
}

/// Writes a file atomically, and creates its folder if it does not exist.
pub(super) fn write_file(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let folder = path.parent().unwrap_or(Path::new(""));
    fs::create_dir_all(folder)
        .and_then(|()| write_atomic(path, bytes))
        .with_context(|| format!("cannot write {}", path.display()))
}

/// Reads a stored evaluation. Returns None if the method has to be evaluated: the file does not exist, or an older
/// version wrote it without `delta_e`.
pub(super) fn read_evaluation(path: &Path) -> anyhow::Result<Option<Evaluation>> {
    let text = match fs::read_to_string(path) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => {
            return Err(error).with_context(|| format!("cannot read {}", path.display()));
        }
    };
    let damaged = || format!("{} is damaged: remove it", path.display());
    let value: Value = serde_json::from_str(&text).with_context(damaged)?;
    // Older versions did not write `delta_e`.
    if value.get("loss").is_some() && value.get("delta_e").is_none() {
        return Ok(None);
    }
    let evaluation = serde_json::from_value(value).with_context(damaged)?;
    Ok(Some(evaluation))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn evaluation_without_color_difference_is_ignored() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path().join("evaluation.json");
        assert!(read_evaluation(&path).unwrap().is_none());
        let mut evaluation_json = json!({
            "loss": 0.1, "dssim": 0.2, "l2": 0.3, "psnr": 5.0, "delta_e": 2.5,
            "seeds": 1, "loss_spread": 0.0, "materials": [],
        });
        fs::write(&path, evaluation_json.to_string()).unwrap();
        let evaluation = read_evaluation(&path)
            .unwrap()
            .expect("the evaluation is stored");
        assert_eq!(evaluation.metrics.delta_e, 2.5);
        evaluation_json
            .as_object_mut()
            .expect("an object")
            .remove("delta_e");
        fs::write(&path, evaluation_json.to_string()).unwrap();
        assert!(read_evaluation(&path).unwrap().is_none());
        fs::write(&path, "{}").unwrap();
        assert!(read_evaluation(&path).is_err());
    }
}
