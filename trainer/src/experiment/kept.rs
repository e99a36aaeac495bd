//! What the store keeps: recipes and judgements, and their files.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use glimpse_trainer::evaluation::{MaterialScores, Verdict};
use glimpse_trainer::export::RecipeFile;
use glimpse_trainer::files::{make_folders, write_whole};
use glimpse_trainer::linear::Basis;
use glimpse_trainer::metrics::Scores;
use serde::{Deserialize, Serialize};

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
    pub(crate) scores: Scores,
    /// How many seeds were averaged over.
    pub(crate) seeds: u64,
    /// Standard deviation of the mean loss from seed to seed.
    pub(crate) loss_spread: f64,
    /// Each material.
    pub(crate) materials: Vec<MaterialScores>,
}

impl From<Verdict> for Evaluation {
    fn from(verdict: Verdict) -> Self {
        let Verdict {
            scores,
            seeds,
            loss_spread,
            materials,
            ..
        } = verdict;
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

/// Reads a judgement that was kept.
pub(super) fn read_evaluation(path: &Path) -> anyhow::Result<Evaluation> {
    let text =
        fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    serde_json::from_str(&text).with_context(|| format!("{} is damaged: remove it", path.display()))
}
