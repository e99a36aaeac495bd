//! `trainer render`

mod lobe;
mod pattern;
mod shared;
mod sphere;
mod view;

use clap::{Args, Subcommand};

/// Draw materials, as spheres or as lobes, where a recipe measures, and a page that fits in the browser.
#[derive(Args)]
pub(crate) struct Render {
    #[command(subcommand)]
    what: What,
}

/// Each is described where its arguments are.
#[derive(Subcommand)]
enum What {
    Sphere(sphere::Sphere),
    Lobe(lobe::Lobe),
    Pattern(pattern::Pattern),
    View(view::View),
}

impl Render {
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        match &self.what {
            What::Sphere(sphere) => sphere.run(seed),
            What::Lobe(lobe) => lobe.run(seed),
            What::Pattern(pattern) => pattern.run(),
            What::View(view) => view.run(seed),
        }
    }
}
