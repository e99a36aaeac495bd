//! `trainer render sphere`

use std::path::PathBuf;

use anyhow::ensure;
use clap::Args;
use glimpse_evaluation::evaluation::SPHERE_SIZE;
use glimpse_evaluation::render::{Image, render_sphere};
use glimpse_materials::Source;
use serde_json::json;

use super::super::numbers::number;
use super::super::{emit, load};
use crate::output::{check_out, file_as_json, file_type, refuse_source, write_file};
use crate::progress::StepProgress;
use crate::report::Table;

/// Maximum width and height of a sphere, in pixels.
const MAX_SIZE: usize = 4_096;
/// Maximum number of pixels of all spheres.
const MAX_PIXELS: usize = 1 << 26;

/// Render materials as spheres.
///
/// The output is a PNG file with the spheres row by row, or a NumPy array of the same pixels as linear
/// radiance (without exposure and tone mapping). The light is an open-air studio. `trainer evaluate
/// --out` and `trainer compare` write pages of spheres with errors.
///
/// Example: trainer render sphere MERL-test/ --columns 5 --out spheres.png
///          trainer render sphere gold-paint.binary --out gold.npy
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Sphere {
    /// Materials (see SOURCES in `trainer --help`)
    source: Source,
    /// Picture to write: *.png or *.npy
    #[arg(long, short, value_name = "FILE", default_value = "sphere.png")]
    out: PathBuf,
    /// Width and height of each sphere in pixels, 1 to 4096
    #[arg(long, value_name = "PIXELS", default_value_t = SPHERE_SIZE, value_parser = number(1..=MAX_SIZE))]
    size: usize,
    /// Materials in a row, 1 to 4096
    #[arg(long, value_name = "COUNT", default_value_t = 8, value_parser = number(1..=MAX_SIZE))]
    columns: usize,
    /// Replace an existing file that differs
    #[arg(long)]
    force: bool,
    /// Print JSON: file, sizes in pixels, and each sphere's row and column
    #[arg(long)]
    json: bool,
}

impl Sphere {
    pub(super) fn run(&self) -> anyhow::Result<()> {
        let file_type = file_type(&self.out, &["png", "npy"])?;
        refuse_source(&self.out, &self.source)?;
        let materials = load(&self.source)?;
        let count = materials.len();
        ensure!(
            count * self.size * self.size <= MAX_PIXELS,
            "{count} spheres of --size {} are too large for one picture: give fewer materials or \
             a smaller --size",
            self.size
        );
        check_out(&self.out)?;
        let steps = StepProgress::new("rendering", count);
        let spheres = materials.iter().map(|material| {
            let sphere = render_sphere(&**material, self.size);
            steps.increment();
            sphere
        });
        let sheet = Image::grid(&spheres.collect::<Vec<_>>(), self.columns, 4);
        drop(steps);
        let bytes = match file_type {
            "png" => sheet.tone_map().to_png()?,
            _ => sheet.to_npy(),
        };
        write_file(&self.out, &bytes, self.force)?;
        let spheres = materials.iter().enumerate().map(|(index, material)| {
            let [row, column] = [index / self.columns + 1, index % self.columns + 1];
            json!({ "material": material.name(), "row": row, "column": column })
        });
        let report = json!({
            "file": file_as_json(&self.out),
            "width": sheet.width,
            "height": sheet.height,
            "sphere_pixels": self.size,
            "spheres": spheres.collect::<Vec<_>>(),
        });
        let columns = [
            ("row", "/row", 0),
            ("column", "/column", 0),
            ("material", "/material", 0),
        ];
        let table = Table::of_records(&columns, &report["spheres"])?;
        emit(self.json, &report, || table.to_markdown())
    }
}
