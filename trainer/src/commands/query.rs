//! `trainer query`

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use glimpse_materials::{Convention, Material, Source};
use glimpse_trainer::measurement::{AngleRow, AngleTable};
use rayon::prelude::*;
use serde_json::{Value, json};

use super::output::{refuse_input, refuse_source};
use super::{load, print, write_file};

/// Look up the BRDF of materials at given angles.
///
/// The angles are a CSV file whose first line names its columns, in any order: theta_h, theta_d,
/// phi_d (half vector to normal, incoming direction to half vector and its azimuth about that),
/// or theta_i, phi_i, theta_o, phi_o (each direction to the normal, and its azimuth). All are in
/// degrees: thetas of directions 0 to 180, theta_h and theta_d 0 to 90. A column index is copied
/// behind them, so that `trainer fit` reads what was looked up at a plan. Other columns are ignored.
///
/// The answer is CSV too, a row for each row: the angles as they were given, and r, g, b, the BRDF in
/// linear RGB and sr^-1, not times the cosine, with digits enough to get the same 32-bit floats
/// back. Where a direction is not above the horizon they are 0. Of several materials, all rows of
/// one come after all rows of the other, and a first column names the material.
///
/// Example: printf 'theta_i,phi_i,theta_o,phi_o\n30,0,30,180\n' > mirror.csv
///          trainer query acrylic_felt_green_rgb.bsdf --angles mirror.csv
///          trainer query MERL/ --angles mirror.csv --out mirror-brdf.csv
///          trainer plan neural-n8.recipe --swap --out plan.csv
///          trainer query gold.binary --angles plan.csv --out gold.csv
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Query {
    /// The materials
    #[arg(value_name = "SRC")]
    source: Source,
    /// Where to look: CSV with angles in degrees
    #[arg(long, value_name = "FILE.csv")]
    angles: PathBuf,
    /// Write the BRDF here [default: standard output]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write JSON instead of CSV
    #[arg(long)]
    json: bool,
}

/// The BRDF of a material at all angles; 0 where a direction is not above the horizon.
type Found = Vec<[f32; 3]>;

impl Query {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        if let Some(out) = &self.out {
            refuse_input(out, &self.angles)?;
            refuse_source(out, &self.source)?;
        }
        let table = AngleTable::read(&self.angles)?;
        let materials = load(&self.source)?;
        let look_up = |material: &dyn Material| -> Found {
            let rows = table.rows.par_iter();
            rows.map(|row| row.angles.map_or([0.0; 3], |angles| material.brdf(angles)))
                .collect()
        };
        let found = materials
            .iter()
            .map(|material| (material.name(), look_up(&**material)));
        let found: Vec<(&str, Found)> = found.collect();
        let text = match self.json {
            true => serde_json::to_string_pretty(&to_json(&found, &table))? + "\n",
            false => to_csv(&found, &table).context("cannot write the table")?,
        };
        match &self.out {
            Some(path) => write_file(path, text.as_bytes()),
            None => print(&text),
        }
    }
}

fn to_csv(found: &[(&str, Found)], table: &AngleTable) -> anyhow::Result<String> {
    let named = found.len() > 1;
    let mut csv = csv::Writer::from_writer(Vec::new());
    let name = |name: &str| named.then(|| name.to_owned()).into_iter();
    let owned = |text: &str| text.to_owned();
    let colors = ["r", "g", "b"].map(owned).into_iter();
    let header = name("material").chain(table.columns.iter().copied().map(owned));
    csv.write_record(header.chain(colors))?;
    for (material, brdf) in found {
        for (row, rgb) in table.rows.iter().zip(brdf) {
            let values = rgb.map(|value| value.to_string());
            let cells = row.cells.iter().cloned().chain(values);
            csv.write_record(name(material).chain(cells))?;
        }
    }
    let bytes = csv.into_inner().map_err(|error| error.into_error())?;
    Ok(String::from_utf8(bytes)?)
}

/// The same as JSON, with what the numbers are.
fn to_json(found: &[(&str, Found)], table: &AngleTable) -> Value {
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
    let material = |(name, brdf): &(&str, Found)| {
        let rows = table.rows.iter().zip(brdf).map(|(at, rgb)| row(at, rgb));
        json!({ "name": name, "rows": rows.collect::<Vec<_>>() })
    };
    let mut all = json!(Convention::BRDF);
    all["materials"] = found.iter().map(material).collect();
    all
}
