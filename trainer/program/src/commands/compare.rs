//! `trainer compare`

use std::path::PathBuf;

use clap::Args;
use glimpse_evaluation::evaluation::Evaluator;
use glimpse_evaluation::metrics::{Metrics, color_differences};
use glimpse_evaluation::render::Picture;
use glimpse_materials::{Material, Source};
use rayon::prelude::*;
use serde_json::json;

use super::lock::Lock;
use super::{emit, load, load_single};
use crate::output::{file_as_json, write_file};
use crate::report::{
    Column, GalleryRow, Lobe, MAX_LOBES, Page, Table, Tile, lobe_svg, metric_columns, metric_row,
};

/// Compare materials with a reference.
///
/// Materials are measurements, fits of `trainer fit`, MERL, RGL, NBRDF or any other source. Each gets
/// the loss of `trainer evaluate`, and the errors of a sphere: CIEDE2000 (about 1 is visible), DSSIM
/// and PSNR. With --out, the folder DIR gets a page, index.html, with spheres, their differences, and
/// lobes in the plane of incidence, and the table as errors.csv.
///
/// Example: trainer compare gold.binary gold-n8/material.json gold-n16/material.json --out compared/
///          trainer compare gold.binary fits/ --json
///          trainer compare gold.binary gold_rgb.bsdf gold_fc1.npy
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Compare {
    /// Reference: a source with a single material (see SOURCES in `trainer --help`)
    reference: Source,
    /// Materials that are compared with it
    #[arg(required = true, value_name = "SOURCE")]
    materials: Vec<Source>,
    /// Folder for the page
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print JSON: reference, page, and material, source, loss, delta_e, dssim, l2 and psnr of each
    #[arg(long)]
    json: bool,
}

/// The color difference that is white in the pictures of differences.
const WHITE_DIFFERENCE: f64 = 10.0;
/// Polar angles of the light in the plots of lobes, degrees.
const LOBE_THETA_I: [f32; 2] = [30.0, 60.0];

/// A material that is compared.
struct Compared {
    material: Box<dyn Material>,
    /// The source, as given.
    source: String,
    /// The material's name, followed by the source if another material or the reference has the same name.
    label: String,
    metrics: Metrics,
    sphere: Picture,
}

impl Compare {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        let references = [load_single(&self.reference)?];
        let evaluator = Evaluator::new(&references);
        let compared = self.compare(&evaluator)?;
        let table = table(references[0].name(), &compared);
        let index = self.out.as_ref().map(|out| out.join("index.html"));
        if let Some(out) = &self.out {
            let _lock = Lock::of_folder(out)?;
            write_file(&out.join("errors.csv"), table.to_csv().as_bytes(), true)?;
            page(&evaluator, &compared, &table).write(out)?;
        }
        let rows = compared.iter().map(|compared| {
            let mut row = serde_json::to_value(compared.metrics)?;
            row["material"] = json!(compared.material.name());
            row["source"] = json!(compared.source);
            Ok(row)
        });
        let report = json!({
            "reference": references[0].name(),
            "page": index.as_deref().map(file_as_json),
            "materials": rows.collect::<anyhow::Result<Vec<_>>>()?,
        });
        emit(self.json, &report, || {
            format!("{}\n\n{}", table.caption, table.to_markdown())
        })
    }

    /// Loads the materials and compares them with the only one of the evaluator.
    fn compare(&self, evaluator: &Evaluator<'_>) -> anyhow::Result<Vec<Compared>> {
        let mut loaded = Vec::new();
        for source in &self.materials {
            let materials = load(source)?.into_iter();
            loaded.extend(materials.map(|material| (source.to_string(), material)));
        }
        let materials = loaded.iter().map(|(_, material)| material);
        let names = evaluator.materials.iter().chain(materials);
        let names: Vec<String> = names.map(|material| material.name().to_owned()).collect();
        let compared = loaded.into_par_iter().map(|(source, material)| {
            let (metrics, sphere) = evaluator.compare(0, &*material);
            let name = material.name();
            let count = names.iter().filter(|other| *other == name).count();
            Compared {
                label: match count {
                    1 => name.to_owned(),
                    _ => format!("{name} ({source})"),
                },
                material,
                source,
                metrics,
                sphere,
            }
        });
        Ok(compared.collect())
    }
}

fn table(reference: &str, compared: &[Compared]) -> Table {
    let row =
        |compared: &Compared| metric_row(&[compared.label[..].into()], &compared.metrics, &[]);
    let columns = [&[Column::text("Material")][..], &metric_columns()].concat();
    let rows = compared.iter().map(row);
    Table::new(format!("Errors against {reference}"), columns, rows)
}

fn page(evaluator: &Evaluator<'_>, compared: &[Compared], table: &Table) -> Page {
    let reference = &*evaluator.materials[0];
    let title = format!("reference: {}", reference.name());
    let rows = compared.iter().map(|compared| {
        let picture = evaluator.reference(0).clone();
        let differences = color_differences(&picture, &compared.sphere, WHITE_DIFFERENCE);
        let fit = (
            compared.label.clone(),
            compared.metrics,
            compared.sphere.clone(),
        );
        let mut row = GalleryRow::of_fits(&compared.label, picture, vec![fit]);
        row.tiles.push(Tile::plain("difference", differences));
        row
    });
    let rows: Vec<GalleryRow> = rows.collect();
    let caption =
        format!("Spheres, and their color difference: {WHITE_DIFFERENCE} and more is white");
    let mut page = Page::new(format!("Glimpse: comparison with {}", reference.name()));
    page.table(table).gallery(&caption, &rows).heading("Lobes");
    for theta_i in LOBE_THETA_I {
        for some in compared.chunks(MAX_LOBES) {
            let lobe =
                |name: &str, brdf: &dyn Material| Lobe::new(name, brdf, theta_i.to_radians());
            let lobes = some
                .iter()
                .map(|compared| lobe(&compared.label, &*compared.material));
            let reference = Lobe {
                is_dashed: true,
                ..lobe(&title, reference)
            };
            let lobes: Vec<Lobe> = lobes.chain([reference]).collect();
            page.drawing(
                &lobe_svg(&lobes),
                &format!("Luminance in the plane of incidence, light at {theta_i} degrees"),
            );
        }
    }
    page
}
