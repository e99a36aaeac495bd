//! Fits a shading model to a material, for `tests/interop/renderers.py`: prints its file, and writes the BRDF that the trainer
//! computes from it.
//!
//! Arguments: principled, gltf or openpbr; a material; a CSV file with rows of theta_i, phi_i, theta_o and phi_o in degrees, without a heading; a file for
//! the BRDF, rows of red, green and blue in sr^-1; and optionally a share, 0 to 1, at which all parameters are in their ranges,
//! instead of the fit.

use std::fmt::Write;

use clap::ValueEnum;
use glimpse_core::geometry::{Directions, HalfDifference};
use glimpse_evaluation::conversion::OutputFormat;
use glimpse_evaluation::metrics::Metrics;
use glimpse_evaluation::shading::{Shading, fit};
use glimpse_materials::{Brdf, Source};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, material, angles, out, share @ ..] = &arguments[..] else {
        return Err("arguments: MODEL MATERIAL ANGLES.csv OUT.csv [SHARE]".into());
    };
    let materials = Source(material.clone()).load()?;
    let material = materials.first().ok_or("the source is empty")?;
    let format = OutputFormat::from_str(model, false);
    let Ok(OutputFormat::Shading(model)) = format else {
        return Err(format!("{model} is not a shading model").into());
    };
    let shading = match share.first() {
        Some(share) => {
            let share: f64 = share.parse()?;
            let values = model.parameters().iter().map(|parameter| {
                let [min, max] = parameter.bounds;
                min + share * (max - min)
            });
            let values = values.collect();
            Shading { model, values }
        }
        None => fit(&**material, model)?,
    };
    let mut table = String::new();
    for line in std::fs::read_to_string(angles)?.lines() {
        let numbers: Vec<f32> = line.split(',').map(str::parse).collect::<Result<_, _>>()?;
        let &[theta_i, phi_i, theta_o, phi_o] = &numbers[..] else {
            return Err(format!("{line} does not have four angles").into());
        };
        let direction = |theta: f32, phi: f32| {
            let (sine, cosine) = theta.to_radians().sin_cos();
            let (y, x) = phi.to_radians().sin_cos();
            [sine * x, sine * y, cosine]
        };
        let directions = Directions {
            incoming: direction(theta_i, phi_i),
            outgoing: direction(theta_o, phi_o),
        };
        let at = HalfDifference::from_directions(&directions).ok_or("opposite directions")?;
        let [red, green, blue] = shading.values_at(&[at])[0];
        writeln!(table, "{red},{green},{blue}")?;
    }
    std::fs::write(out, table)?;
    let file = shading.to_file(material.name(), &Metrics::default());
    print!("{}", String::from_utf8(file)?);
    Ok(())
}
