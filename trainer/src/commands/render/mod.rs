//! `trainer render`

mod pattern;
mod sphere;
mod view;

use std::path::Path;

use anyhow::bail;
use clap::{Args, Subcommand};

/// Render spheres, patterns, or an interactive page.
#[derive(Args)]
pub(crate) struct Render {
    #[command(subcommand)]
    command: RenderCommand,
}

/// The subcommands of `render`. The module of each has its arguments and help text.
#[derive(Subcommand)]
enum RenderCommand {
    Sphere(sphere::Sphere),
    Pattern(pattern::Pattern),
    View(view::View),
}

impl Render {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        match &self.command {
            RenderCommand::Sphere(sphere) => sphere.run(seed),
            RenderCommand::Pattern(pattern) => pattern.run(),
            RenderCommand::View(view) => view.run(seed),
        }
    }
}

/// Returns the extension of an output path, in lower case, which must be one of `types`.
fn file_type(path: &Path, types: &[&'static str]) -> anyhow::Result<&'static str> {
    let extension = path.extension().and_then(|extension| extension.to_str());
    let extension = extension.unwrap_or_default().to_ascii_lowercase();
    match types.iter().find(|known| **known == extension) {
        Some(file_type) => Ok(file_type),
        None => bail!(
            "--out {}: unsupported file type, give a name with the extension .{}",
            path.display(),
            types.join(" or .")
        ),
    }
}
