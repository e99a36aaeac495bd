//! Draws the spheres of a set of materials on one sheet:
//! `cargo run --release -p glimpse-trainer --example spheres -- SOURCE SHEET.png [SIZE]`.

use std::path::Path;
use std::time::Instant;

use glimpse_core::angles::HalfDifference;
use glimpse_trainer::material::Source;
use glimpse_trainer::render::{Environment, Picture, render_sphere};

/// Spheres in a row.
const COLUMNS: usize = 10;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [source, sheet, rest @ ..] = arguments.as_slice() else {
        return Err("usage: spheres SOURCE SHEET.png [SIZE]".into());
    };
    let size = rest.first().map_or(Ok(128), |size| size.parse())?;
    let environment = Environment::studio();
    let mut pictures = Vec::new();
    for material in Source(source.clone()).load()? {
        let begin = Instant::now();
        let brdf = |at: &[HalfDifference<f32>], values: &mut [[f32; 3]]| {
            material.brdf_batch(at, values);
        };
        pictures.push(render_sphere(&brdf, &environment, size).tone_map());
        println!("{} {:.3} s", material.name(), begin.elapsed().as_secs_f64());
    }
    let rows: Vec<&[Picture]> = pictures.chunks(COLUMNS).collect();
    Picture::grid(&rows, 4, [0; 3]).write_png(Path::new(sheet))?;
    Ok(())
}
