//! `trainer render`

mod pattern;
mod sphere;
mod view;

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
            RenderCommand::Sphere(sphere) => sphere.run(),
            RenderCommand::Pattern(pattern) => pattern.run(),
            RenderCommand::View(view) => view.run(seed),
        }
    }
}
