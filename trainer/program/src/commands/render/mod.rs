//! `trainer render`

mod pattern;
mod sphere;
mod view;

use clap::Subcommand;

/// Render spheres, patterns, or an interactive page.
#[derive(Subcommand)]
pub(crate) enum Render {
    Sphere(sphere::Sphere),
    Pattern(pattern::Pattern),
    View(view::View),
}

impl Render {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        match self {
            Self::Sphere(sphere) => sphere.run(),
            Self::Pattern(pattern) => pattern.run(),
            Self::View(view) => view.run(seed),
        }
    }
}
