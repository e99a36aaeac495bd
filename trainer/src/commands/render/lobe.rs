//! `trainer render lobe`

use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use glimpse_materials::Source;
use glimpse_trainer::evaluation::Method;
use glimpse_trainer::report::{self, MAX_LOBES, lobe, lobe_svg};

use super::super::load;
use super::super::numbers::checked;
use super::super::output::{check_out, refuse_input, refuse_source, write_file};
use super::shared::{file_type, with_method};

/// Plot BRDFs in the plane of incidence: the logarithm of the luminance over the angle.
///
/// The plot has a curve for each material and each angle of the light, at most six. With --recipe,
/// a second, dashed curve shows the scan of the material.
///
/// Example: trainer render lobe gold-paint.binary --theta-i 30,60 --out gold.svg
///          trainer render lobe procedural:2 --recipe neural-n8.recipe
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(super) struct Lobe {
    /// Materials (see SOURCES in `trainer --help`)
    source: Source,
    /// Polar angles of the light in degrees, from 0 to below 90, separated by commas
    #[arg(
        long,
        value_name = "DEGREES,...",
        value_delimiter = ',',
        default_value = "45",
        value_parser = above_horizon
    )]
    theta_i: Vec<f32>,
    /// Recipe file for scans of the materials
    #[arg(long, value_name = "FILE")]
    recipe: Option<PathBuf>,
    /// Plot to write
    #[arg(long, short, value_name = "FILE.svg", default_value = "lobe.svg")]
    out: PathBuf,
    /// Replace an existing file that differs
    #[arg(long)]
    force: bool,
}

/// Parses a polar angle in degrees, from 0 to below 90.
fn above_horizon(text: &str) -> Result<f32, String> {
    let is_valid = |angle: &f32| (0.0..90.0).contains(angle);
    checked(text, is_valid, "an angle from 0 to below 90 degrees")
}

impl Lobe {
    pub(super) fn run(&self, seed: u64) -> anyhow::Result<()> {
        file_type(&self.out, &["svg"])?;
        if let Some(recipe) = &self.recipe {
            refuse_input(&self.out, recipe)?;
        }
        with_method(self.recipe.as_deref(), |method| self.draw(method, seed))
    }

    fn draw(&self, method: Option<&Method<'_>>, seed: u64) -> anyhow::Result<()> {
        refuse_source(&self.out, &self.source)?;
        let materials = load(&self.source)?;
        let curves = materials.len() * self.theta_i.len();
        if curves > MAX_LOBES {
            bail!(
                "{} materials at {} angles make {curves} curves, but a plot has at most {MAX_LOBES}: \
                 give fewer materials or fewer angles",
                materials.len(),
                self.theta_i.len()
            );
        }
        check_out(&self.out)?;
        let mut lobes = Vec::new();
        for (index, material) in materials.iter().enumerate() {
            let seed = seed.wrapping_add(index as u64);
            let fitted = method.map(|method| method.fit(&**material, seed));
            let fitted = fitted.transpose()?;
            for degrees in &self.theta_i {
                let theta_i = degrees.to_radians();
                let name = format!("{}, light at {degrees}\u{b0}", material.name());
                let scanned = |fitted| (format!("{name}, scanned"), lobe(fitted, theta_i));
                let dashed = fitted.as_ref().map(scanned);
                lobes.push(report::Lobe {
                    curve: lobe(&**material, theta_i),
                    name,
                    theta_i,
                    dashed,
                });
            }
        }
        write_file(&self.out, lobe_svg(&lobes).as_bytes(), self.force)
    }
}
