//! `trainer render pattern`

use std::path::PathBuf;

use crate::report::pattern_svg;
use clap::Args;

use super::super::geometry::GeometryArgs;
use crate::output::{file_type, refuse_input, write_file};

/// Plot a recipe's pattern: over theta_h and theta_d, and as directions of light and sensor.
///
/// Example: trainer render pattern neural-n8.recipe --out pattern.svg
#[derive(Args)]
pub(crate) struct Pattern {
    /// Recipe file, or the name of a bundled recipe
    recipe: PathBuf,
    #[command(flatten)]
    geometry: GeometryArgs,
    /// Plot to write
    #[arg(long, short, value_name = "FILE.svg", default_value = "pattern.svg")]
    out: PathBuf,
    /// Replace an existing file that differs
    #[arg(long)]
    force: bool,
}

impl Pattern {
    pub(super) fn run(&self) -> anyhow::Result<()> {
        file_type(&self.out, &["svg"])?;
        let file = self.geometry.read_file(&self.recipe)?;
        refuse_input(&self.out, &self.recipe)?;
        let pattern: Vec<_> = file.recipe().pattern().collect();
        write_file(&self.out, pattern_svg(&pattern).as_bytes(), self.force)
    }
}
