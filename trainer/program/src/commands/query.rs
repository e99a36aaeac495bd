//! `trainer query`

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use glimpse_fitting::measurement::{AngleArgs, AngleRow, AngleTable};
use glimpse_materials::{Convention, Source};
use rayon::prelude::*;
use serde_json::{Value, json};

use super::{load_measured, print};
use crate::output::{refuse_input, refuse_source, write_file};

/// Evaluate the BRDF of materials at given angles.
///
/// INPUT. A CSV file with a line that names the columns, in any order. The angles are
///
/// - theta_h (half vector to normal) and theta_d (incoming direction to half vector), 0 to 90, and
///   phi_d (azimuth of the incoming direction about the half vector);
/// - or theta_i, phi_i, theta_o, phi_o, the polar angle of each direction to the normal, 0 to 180,
///   and its azimuth;
/// - or theta_i, theta_o, phi, with the azimuth of the sensor from that of the light;
/// - or theta_i, theta_o in one plane: theta_o is positive on the side of the mirror direction.
///
/// The optional column index is copied to the output, so that `trainer fit` can read the BRDF at
/// the angles of a plan. Other columns are ignored.
///
/// OUTPUT. CSV with a row for each input row: the angles, and the BRDF in the columns r, g, b, as
/// linear RGB in sr^-1, not multiplied by the cosine. The numbers have enough digits to restore the
/// 32-bit floats. The BRDF is 0 if a direction is not above the horizon, and empty (in JSON null) if
/// it is unknown: trainer/docs/formats.md, Unmeasured directions. With several materials, a first
/// column names the material, and all rows of a material are together.
///
/// Example: printf 'theta_i,phi_i,theta_o,phi_o\n30,0,30,180\n' > mirror.csv
///          trainer query acrylic_felt_green_rgb.bsdf --angles mirror.csv
///          trainer query MERL/ --angles mirror.csv --out mirror-brdf.csv
///          trainer plan neural-n8.recipe --out plan.csv
///          trainer query gold.binary --angles plan.csv --out gold.csv
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Query {
    /// Materials (see SOURCES in `trainer --help`)
    source: Source,
    /// CSV file with angles in degrees
    #[arg(long, value_name = "FILE.csv")]
    angles: PathBuf,
    #[command(flatten)]
    angle_args: AngleArgs,
    /// Output file [default: standard output]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Replace an existing file that differs
    #[arg(long, requires = "out")]
    force: bool,
    /// Write JSON instead of CSV
    #[arg(long)]
    json: bool,
}

/// The name of a material, and its BRDF at all rows of a table of angles; 0 where a direction is not above the horizon, NaN where it is
/// unknown.
type MaterialValues<'a> = (&'a str, Vec<[f32; 3]>);

impl Query {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        if let Some(out) = &self.out {
            refuse_input(out, &self.angles)?;
            refuse_source(out, &self.source)?;
        }
        let table = AngleTable::read(&self.angles, &self.angle_args)?;
        let materials = load_measured(&self.source)?;
        let values = materials.iter().map(|material| {
            let at = |angles| material.at_angles(angles);
            let brdf = table
                .rows
                .par_iter()
                .map(|row| row.angles.map_or([0.0; 3], at));
            (material.name(), brdf.collect())
        });
        let values: Vec<MaterialValues<'_>> = values.collect();
        let text = match self.json {
            true => serde_json::to_string_pretty(&to_json(&values, &table))? + "\n",
            false => to_csv(&values, &table).context("cannot write the table")?,
        };
        match &self.out {
            Some(path) => write_file(path, text.as_bytes(), self.force),
            None => print(&text),
        }
    }
}

fn to_csv(values: &[MaterialValues<'_>], table: &AngleTable) -> anyhow::Result<String> {
    let named = values.len() > 1;
    let mut csv = csv::Writer::from_writer(Vec::new());
    let name = |name: &str| named.then(|| name.to_owned()).into_iter();
    let owned = |text: &str| text.to_owned();
    let colors = ["r", "g", "b"].map(owned).into_iter();
    let header = name("material").chain(table.columns.iter().copied().map(owned));
    csv.write_record(header.chain(colors))?;
    for (material, brdf) in values {
        for (row, rgb) in table.rows.iter().zip(brdf) {
            let values = rgb.map(|value| match value.is_nan() {
                true => String::new(),
                false => value.to_string(),
            });
            let cells = row.cells.iter().cloned().chain(values);
            csv.write_record(name(material).chain(cells))?;
        }
    }
    let bytes = csv.into_inner().map_err(|error| error.into_error())?;
    Ok(String::from_utf8(bytes)?)
}

/// Returns the values as JSON, with their quantity and unit.
fn to_json(values: &[MaterialValues<'_>], table: &AngleTable) -> Value {
    let cell = |text: &String| match (text.parse::<u64>(), text.parse::<f64>()) {
        (Ok(whole), _) => json!(whole),
        (_, Ok(number)) => json!(number),
        _ => json!(text),
    };
    let row = |row: &AngleRow, rgb: &[f32; 3]| -> Value {
        let named = table.columns.iter().zip(&row.cells);
        let mut object: Value = named
            .map(|(name, text)| ((*name).to_owned(), cell(text)))
            .collect();
        object["brdf"] = json!(rgb);
        object
    };
    let material = |(material, brdf): &MaterialValues<'_>| {
        let rows = table.rows.iter().zip(brdf).map(|(at, rgb)| row(at, rgb));
        json!({ "name": material, "rows": rows.collect::<Vec<_>>() })
    };
    let mut all = json!(Convention::BRDF);
    all["materials"] = values.iter().map(material).collect();
    all
}
