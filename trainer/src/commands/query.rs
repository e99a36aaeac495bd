//! `trainer query`

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use glimpse_trainer::material::{Material, Source};
use glimpse_trainer::measurement::AngleTable;
use rayon::prelude::*;

use super::output::{refuse_input, refuse_source};
use super::{load, print, write_file};

/// Look up the BRDF of materials at given angles.
///
/// The angles are a CSV file whose first line names its columns, in any order: theta_h, theta_d,
/// phi_d (half vector to normal, incoming direction to half vector and its azimuth about that),
/// or theta_i, phi_i, theta_o, phi_o (each direction to the normal, and its azimuth). All are in
/// degrees: thetas of directions 0 to 180, theta_h and theta_d 0 to 90. Other columns are passed
/// over.
///
/// The answer is CSV too, a row for each row: the angles as they were given, and r, g, b, the BRDF in
/// linear RGB and sr^-1, not times the cosine, with digits enough to get the same 32-bit floats
/// back. Where a direction is not above the horizon they are 0. Of several materials, all rows of
/// one come after all rows of the other, and a first column names the material.
///
/// Example: printf 'theta_i,phi_i,theta_o,phi_o\n30,0,30,180\n' > mirror.csv
///          trainer query acrylic_felt_green_rgb.bsdf --angles mirror.csv
///          trainer query MERL/ --angles mirror.csv --out mirror-brdf.csv
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
    #[arg(long, value_name = "FILE.csv")]
    out: Option<PathBuf>,
}

impl Query {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        if let Some(out) = &self.out {
            refuse_input(out, &self.angles)?;
            refuse_source(out, &self.source)?;
        }
        let table = AngleTable::read(&self.angles)?;
        let materials = load(&self.source)?;
        let csv = to_csv(&materials, &table).context("cannot write the table")?;
        match &self.out {
            Some(path) => write_file(path, csv.as_bytes()),
            None => print(&csv),
        }
    }
}

/// The BRDF of each material at all angles; 0 where there are none.
fn to_csv(materials: &[Box<dyn Material>], table: &AngleTable) -> anyhow::Result<String> {
    let named = materials.len() > 1;
    let mut csv = csv::Writer::from_writer(Vec::new());
    let name = |name: &str| named.then(|| name.to_owned()).into_iter();
    let owned = |text: &str| text.to_owned();
    let colours = ["r", "g", "b"].map(owned).into_iter();
    let header = name("material").chain(table.columns.iter().copied().map(owned));
    csv.write_record(header.chain(colours))?;
    for material in materials {
        let brdf: Vec<[f32; 3]> = table
            .rows
            .par_iter()
            .map(|row| row.angles.map_or([0.0; 3], |angles| material.brdf(angles)))
            .collect();
        for (row, rgb) in table.rows.iter().zip(brdf) {
            let values = rgb.map(|value| value.to_string());
            let cells = row.cells.iter().cloned().chain(values);
            csv.write_record(name(material.name()).chain(cells))?;
        }
    }
    let bytes = csv.into_inner().map_err(|error| error.into_error())?;
    Ok(String::from_utf8(bytes)?)
}
