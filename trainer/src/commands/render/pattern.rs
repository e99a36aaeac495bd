//! `trainer render pattern`

use std::path::PathBuf;

use clap::Args;
use glimpse_trainer::report::pattern_svg;
use glimpse_training::recipe::RecipeFile;
use serde_json::json;

use super::super::output::{file_as_json, refuse_input};
use super::super::{print_json, write_file};
use super::shared::{check_out, file_type};

/// Plot a recipe's pattern: over theta_h and theta_d, and as directions of light and sensor.
///
/// Example: trainer render pattern neural-n8.recipe --out pattern.svg
#[derive(Args)]
pub(super) struct Pattern {
    /// Recipe file
    recipe: PathBuf,
    /// Plot to write
    #[arg(long, short, value_name = "FILE.svg", default_value = "pattern.svg")]
    out: PathBuf,
    /// Print JSON: file, model and samples
    #[arg(long)]
    json: bool,
}

impl Pattern {
    pub(super) fn run(&self) -> anyhow::Result<()> {
        file_type(&self.out, &["svg"])?;
        let file = RecipeFile::read(&self.recipe)?;
        refuse_input(&self.out, &self.recipe)?;
        check_out(&self.out)?;
        let recipe = file.recipe();
        let pattern: Vec<_> = recipe.pattern().collect();
        write_file(&self.out, pattern_svg(&pattern).as_bytes())?;
        if !self.json {
            return Ok(());
        }
        print_json(&json!({
            "file": file_as_json(&self.out),
            "model": recipe.model().name(),
            "samples": recipe.samples(),
        }))
    }
}
