//! What the store keeps: recipes and judgments, and their files.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use glimpse_materials::basis::Basis;
use glimpse_materials::files::{make_folders, write_whole};
use glimpse_trainer::evaluation::{MaterialMetrics, Report};
use glimpse_trainer::metrics::Metrics;
use glimpse_training::recipe::RecipeFile;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// A trained recipe, and the basis of one of Linear.
pub(crate) struct Recipe {
    pub(crate) file: RecipeFile,
    pub(crate) basis: Option<Basis>,
}

/// How well a method did, as it is kept.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Evaluation {
    /// Means over the materials.
    #[serde(flatten)]
    pub(crate) scores: Metrics,
    /// How many seeds were averaged over.
    pub(crate) seeds: u64,
    /// Standard deviation of the mean loss from seed to seed.
    pub(crate) loss_spread: f64,
    /// Each material.
    pub(crate) materials: Vec<MaterialMetrics>,
}

impl From<Report> for Evaluation {
    fn from(report: Report) -> Self {
        let Report {
            scores,
            seeds,
            loss_spread,
            materials,
            ..
        } = report;
        Self {
            scores,
            seeds,
            loss_spread,
            materials,
        }
    }
}

impl Recipe {
    /// From a recipe's file, and the bytes of its basis.
    pub(super) fn of(file: RecipeFile, basis: Option<&[u8]>) -> anyhow::Result<Self> {
        let basis = basis
            .map(Basis::from_bytes)
            .transpose()
            .map_err(|what| anyhow!("the basis: {what}"))?;
        Ok(Self { file, basis })
    }
}

/// Adds an extension; what looks like one in the name stays.
pub(super) fn with_extension(path: &Path, extension: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".");
    name.push(extension);
    name.into()
}

/// Writes a file of the experiments' folder, which is there, whole or not at all.
pub(super) fn keep(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let folder = path.parent().unwrap_or(Path::new(""));
    make_folders(folder)
        .and_then(|()| write_whole(path, bytes))
        .with_context(|| format!("cannot write {}", path.display()))
}

/// Reads an evaluation that was kept. Returns None if there is none, or it lacks a metric because an
/// older version wrote it: it has to be made again.
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
    // Older versions wrote all metrics but this one.
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
    fn an_evaluation_without_color_difference_is_made_again() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path().join("sheet.json");
        assert!(read_evaluation(&path).unwrap().is_none());
        let mut sheet = json!({
            "loss": 0.1, "dssim": 0.2, "l2": 0.3, "psnr": 5.0, "delta_e": 2.5,
            "seeds": 1, "loss_spread": 0.0, "materials": [],
        });
        fs::write(&path, sheet.to_string()).unwrap();
        let evaluation = read_evaluation(&path).unwrap().expect("it is whole");
        assert_eq!(evaluation.scores.delta_e, 2.5);
        sheet.as_object_mut().expect("an object").remove("delta_e");
        fs::write(&path, sheet.to_string()).unwrap();
        assert!(read_evaluation(&path).unwrap().is_none());
        fs::write(&path, "{}").unwrap();
        assert!(read_evaluation(&path).is_err());
    }
}
