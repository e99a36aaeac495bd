//! `trainer render sphere`

use std::path::PathBuf;

use crate::report::{Cell, Column, Table};
use anyhow::ensure;
use clap::Args;
use glimpse_evaluation::evaluation::{Method, SPHERE_SIZE};
use glimpse_evaluation::metrics::{METRICS, Metrics};
use glimpse_evaluation::render::{Image, render_sphere};
use glimpse_materials::loss::loss_between;
use glimpse_materials::{Material, Source};
use serde_json::{Value, json};

use super::super::numbers::number;
use super::super::output::{
    check_out, file_as_json, file_type, refuse_input, refuse_source, write_file,
};
use super::super::progress::StepProgress;
use super::super::training_overlap::warn_of_overlap;
use super::super::{emit, load, read_recipe};

/// Maximum width and height of a sphere, in pixels.
const MAX_SIZE: usize = 4_096;
/// Maximum number of pixels of all spheres.
const MAX_PIXELS: usize = 1 << 26;
/// Minimum width and height of spheres that are compared: the size of SSIM's window, in pixels.
const MIN_COMPARED_SIZE: usize = 7;

/// Render materials as spheres, and with --recipe their scans.
///
/// The output is a PNG file with the spheres row by row, or a NumPy array of the same pixels as linear
/// radiance (without exposure and tone mapping). The loss is that of `trainer evaluate`; DSSIM, L2,
/// PSNR and delta E are those of the pictures. At the default size they equal the metrics of
/// `evaluate`. The light is an open-air studio. `trainer compare` writes a page of spheres with errors.
///
/// Example: trainer render sphere MERL-test/ --columns 5 --out spheres.png
///          trainer render sphere procedural:8:1 --recipe neural-n8.recipe --out scans.png
///          trainer render sphere gold-paint.binary --out gold.npy
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(super) struct Sphere {
    /// Materials (see SOURCES in `trainer --help`)
    source: Source,
    /// Recipe file for scans of the materials
    #[arg(long, value_name = "FILE")]
    recipe: Option<PathBuf>,
    /// Picture to write: *.png or *.npy
    #[arg(long, short, value_name = "FILE", default_value = "sphere.png")]
    out: PathBuf,
    /// Width and height of each sphere in pixels, 1 to 4096
    #[arg(long, value_name = "PIXELS", default_value_t = SPHERE_SIZE, value_parser = number(1..=MAX_SIZE))]
    size: usize,
    /// Materials in a row, 1 to 4096 [default: up to 8; with --recipe up to 4]
    #[arg(long, value_name = "COUNT", value_parser = number(1..=MAX_SIZE))]
    columns: Option<usize>,
    /// Replace an existing file that differs
    #[arg(long)]
    force: bool,
    /// Print JSON: file, sizes in pixels, and each sphere's row, column and errors
    #[arg(long)]
    json: bool,
}

/// The sphere of a material, with the errors and the sphere of its scan if there is a recipe.
struct RenderedMaterial<'a> {
    name: &'a str,
    sphere: Image,
    scan: Option<(Metrics, Image)>,
}

impl Sphere {
    pub(super) fn run(&self, seed: u64) -> anyhow::Result<()> {
        let file_type = file_type(&self.out, &["png", "npy"])?;
        ensure!(
            self.recipe.is_none() || self.size >= MIN_COMPARED_SIZE,
            "--size {} is too small to compare a scan with its material: give {MIN_COMPARED_SIZE} or \
             more",
            self.size
        );
        if let Some(recipe) = &self.recipe {
            refuse_input(&self.out, recipe)?;
        }
        refuse_source(&self.out, &self.source)?;
        let named = self.recipe.as_deref().map(read_recipe).transpose()?;
        let recipe = named.as_ref().map(|named| named.file.recipe());
        let basis = named.as_ref().and_then(|named| named.basis.as_deref());
        let method = recipe
            .as_ref()
            .map(|recipe| Method::with_recipe(recipe, basis));
        let method = method.transpose()?;
        let materials = load(&self.source)?;
        let spheres = materials.len() * if method.is_some() { 2 } else { 1 };
        ensure!(
            spheres * self.size * self.size <= MAX_PIXELS,
            "{spheres} spheres of --size {} are too large for one picture: give fewer materials or \
             a smaller --size",
            self.size
        );
        check_out(&self.out)?;

        let steps = StepProgress::new("rendering", materials.len());
        if let Some(recipe) = &recipe {
            warn_of_overlap(recipe, &materials)?;
        }
        let mut all = Vec::new();
        for material in &materials {
            let sphere = render_sphere(&**material, self.size);
            let scan = method
                .as_ref()
                .map(|method| scan(&**material, &sphere, method, seed));
            all.push(RenderedMaterial {
                name: material.name(),
                scan: scan.transpose()?,
                sphere,
            });
            steps.increment();
        }
        drop(steps);
        let columns = self.columns.unwrap_or(match method {
            Some(_) => 4,
            None => 8,
        });
        let sheet = sheet(&all, columns);
        let bytes = match file_type {
            "png" => sheet.tone_map().to_png()?,
            _ => sheet.to_npy(),
        };
        write_file(&self.out, &bytes, self.force)?;
        let report = self.to_json(&all, columns, &sheet);
        emit(self.json, &report, || table(&all, columns).to_text())
    }

    /// Returns the result as JSON.
    fn to_json(&self, all: &[RenderedMaterial<'_>], columns: usize, sheet: &Image) -> Value {
        let sphere = |(index, material): (usize, &RenderedMaterial<'_>)| {
            json!({
                "material": material.name,
                "row": index / columns + 1,
                "column": index % columns + 1,
                "scan": material.scan.as_ref().map(|(metrics, _)| metrics),
            })
        };
        json!({
            "file": file_as_json(&self.out),
            "width": sheet.width,
            "height": sheet.height,
            "sphere_pixels": self.size,
            "spheres": all.iter().enumerate().map(sphere).collect::<Vec<_>>(),
        })
    }
}

/// Scans a material, and compares the fit and its sphere with the material and its sphere.
fn scan(
    material: &dyn Material,
    sphere: &Image,
    method: &Method<'_>,
    seed: u64,
) -> anyhow::Result<(Metrics, Image)> {
    let fitted = method.fit(material, seed)?;
    let image = render_sphere(&fitted, sphere.width);
    let loss = loss_between(&fitted, material);
    let metrics = Metrics::from_spheres(loss, &sphere.tone_map(), &image.tone_map())?;
    Ok((metrics, image))
}

/// Arranges all spheres in a grid. A scan is to the right of its material, without a gap.
fn sheet(all: &[RenderedMaterial<'_>], columns: usize) -> Image {
    let cell = |material: &RenderedMaterial<'_>| match &material.scan {
        Some((_, scan)) => Image::grid(&[material.sphere.clone(), scan.clone()], 2, 0),
        None => material.sphere.clone(),
    };
    let cells: Vec<Image> = all.iter().map(cell).collect();
    Image::grid(&cells, columns, 4)
}

/// Returns a table with the position of each material in the grid, and the errors of its scan.
fn table(all: &[RenderedMaterial<'_>], columns: usize) -> Table {
    let mut heads = vec![
        Column::plain("row", 0),
        Column::plain("column", 0),
        Column::text("material"),
    ];
    if all.iter().any(|material| material.scan.is_some()) {
        // The materials are different, so none of them is the best.
        heads.extend(METRICS.map(|metric| Column::plain(metric.title, metric.decimals)));
    }
    let row = |(index, material): (usize, &RenderedMaterial<'_>)| {
        let mut cells: Vec<Cell> = vec![
            (index / columns + 1).into(),
            (index % columns + 1).into(),
            material.name.into(),
        ];
        if let Some((metrics, _)) = &material.scan {
            cells.extend(Cell::of_metrics(metrics));
        }
        cells
    };
    Table::new("", heads, all.iter().enumerate().map(row))
}
