//! Surface scattering distribution data (SSDD), the text format of libbsdf: version 0.2.
//!
//! Metadata lines `KEY values` come first, then a line for each node: the BRDF in sr^-1, not times the cosine, in linear RGB or in
//! bands. Nodes are products of angles in half-difference coordinates, theta_h fastest and phi_d slowest.

use std::fmt::Write;
use std::path::Path;

use glimpse_core::geometry::{Angles, HalfDifference};
use rayon::prelude::*;

use crate::color::{FROM_XYZ, IDENTITY};
use crate::error::{Defect, ensure, read_text};
use crate::interpolation::corners;
use crate::lists::add_scaled;
use crate::spectrum::{Viewing, have_color, weighted_sums};
use crate::untrusted::escaped;
use crate::{MerlTable, NotFinite, Omission, SourceError, Tabulation, table_nodes};

/// The start of a file.
pub(super) const SIGNATURE: &str = "VERSION ";
/// The largest length of a file in bytes.
const MAX_BYTES: u64 = 1 << 29;
/// The numbers of written theta_h, denser near the normal, theta_d, and phi_d over half a turn.
const NODES: [usize; 3] = [61, 31, 31];
/// Directions of written nodes are at least this far above the horizon, degrees.
const HORIZON: f32 = 0.5;

/// Tabulates a reciprocal BRDF in RGB, or each of its bands.
///
/// # Errors
/// If the BRDF is not finite at a node.
pub(super) fn to_ssdd(table: &Tabulation<'_>) -> Result<Vec<u8>, NotFinite> {
    let wavelengths = table.wavelengths;
    let axes = axes();
    let list = |values: &[f32]| {
        let values = values.iter().map(|value| format!("{:.4}", value));
        values
            .map(|value| value.trim_end_matches('0').trim_end_matches('.').to_owned())
            .collect::<Vec<_>>()
            .join(" ")
    };
    let [theta_h, theta_d, phi_d] = axes.each_ref().map(|axis| list(axis));
    let color = match wavelengths {
        [] => "rgb".to_owned(),
        _ => format!("spectrum\nWAVELENGTH_LIST {}", list(wavelengths)),
    };
    let name = table.name.replace(['\n', '#'], "_");
    let mut text = format!(
        "{SIGNATURE}0.2\nSOFTWARE glimpse-trainer-{}\nDATA_TYPE brdf\nCOLOR_MODEL {color}\n\
         PARAM_TYPE half_difference_coordinate_system\nREDUCTION_TYPE reciprocity\n\
         PARAM0_LIST {theta_h}\nPARAM2_LIST {theta_d}\nPARAM3_LIST {phi_d}\n\
         NAME {name}\nSOURCE_TYPE generated\nDATA ascii\n",
        env!("CARGO_PKG_VERSION")
    );
    let at: Vec<HalfDifference<f32>> = nodes(&axes).map(above_horizon).collect();
    let columns = table.columns();
    let columns = columns
        .par_iter()
        .map(|column| column.written_values_at(&at));
    let columns: Vec<Vec<[f32; 3]>> = columns.collect::<Result<_, _>>()?;
    let count = if wavelengths.is_empty() {
        3
    } else {
        wavelengths.len()
    };
    for node in 0..at.len() {
        let values = columns.iter().flat_map(|column| column[node]).take(count);
        let values: Vec<String> = values.map(|value| format!("{value:.6e}")).collect();
        // Writing to a string never fails.
        let _ = writeln!(text, "{}", values.join(" "));
    }
    Ok(text.into_bytes())
}

/// Returns the written theta_h, theta_d and phi_d, degrees.
fn axes() -> [Vec<f32>; 3] {
    let steps = |axis: usize, largest: f32, power: i32| {
        let last = (NODES[axis] - 1) as f32;
        (0..NODES[axis])
            .map(|step| largest * (step as f32 / last).powi(power))
            .collect()
    };
    [steps(0, 90.0, 2), steps(1, 90.0, 1), steps(2, 180.0, 1)]
}

fn nodes(axes: &[Vec<f32>; 3]) -> impl Iterator<Item = Angles<f32>> + '_ {
    let [theta_h, theta_d, phi_d] = axes;
    phi_d.iter().flat_map(move |phi_d| {
        theta_d.iter().flat_map(move |theta_d| {
            theta_h.iter().map(move |theta_h| Angles {
                theta_h: theta_h.to_radians(),
                theta_d: theta_d.to_radians(),
                phi_d: phi_d.to_radians(),
            })
        })
    })
}

/// Returns the directions of a node, with the largest theta_d up to that of the node at which both are above the horizon.
fn above_horizon(mut angles: Angles<f32>) -> HalfDifference<f32> {
    angles.theta_h = angles.theta_h.min((90.0 - 2.0 * HORIZON).to_radians());
    loop {
        let at = HalfDifference::from_angles(angles);
        let lowest = at.cos_theta_i().min(at.cos_theta_o());
        if lowest >= HORIZON.to_radians().sin() || angles.theta_d <= 0.0 {
            return at;
        }
        angles.theta_d = (angles.theta_d - HORIZON.to_radians()).max(0.0);
    }
}

/// Reads the BRDF of a file, and resamples it to MERL's table.
///
/// # Errors
/// If the file cannot be read, is damaged, or is not an isotropic BRDF in half-difference coordinates and text.
pub(crate) fn read(path: &Path, name: String) -> Result<MerlTable, SourceError> {
    let text = read_text(path, MAX_BYTES)?;
    parse(name, &text).map_err(Defect::in_file(path))
}

fn parse(name: String, text: &str) -> Result<MerlTable, Defect> {
    let lines = text.lines().map(str::trim);
    let lines = lines.filter(|line| !line.is_empty() && !line.starts_with("# "));
    let lines: Vec<&str> = lines.collect();
    let (mut brdf, mut omissions) = (None, Vec::new());
    let blocks = lines.chunk_by(|_, next| !next.starts_with("DATA_TYPE "));
    // The header precedes them.
    for block in blocks.skip(1) {
        match block[0]["DATA_TYPE ".len()..].trim_start() {
            "brdf" if brdf.is_none() => brdf = Some(block),
            "btdf" => omissions.push(Omission::Transmission),
            "specular_reflectance" => omissions.push(Omission::SpecularReflectance),
            "specular_transmittance" => omissions.push(Omission::SpecularTransmittance),
            _ => return Err(format!("its {} is unknown or repeats", escaped(block[0])).into()),
        }
    }
    let defect = format!("it has no DATA_TYPE brdf, only {omissions:?}");
    let block = brdf.ok_or(Defect::new(defect, "give a file of a BRDF"))?;
    let end = block.iter().position(|line| *line == "DATA ascii");
    let (metadata, rows) = block.split_at(end.map_or(block.len(), |end| end + 1));
    let value = |key: &str| {
        let values = metadata
            .iter()
            .filter_map(|line| line.strip_prefix(key)?.strip_prefix(' '));
        values.map(str::trim).next().unwrap_or_default()
    };
    for (key, supported) in [
        ("PARAM_TYPE", "half_difference_coordinate_system"),
        ("PARAM1_LIST", ""),
    ] {
        if value(key) != supported {
            return Err(Defect::unsupported(format!(
                "its {key} is `{}`, and only isotropic BRDFs in half-difference coordinates with DATA ascii are supported",
                escaped(value(key))
            )));
        }
    }
    let numbers = |line: &str| -> Result<Vec<f32>, Defect> {
        let numbers = line.split_whitespace().map(|word| word.parse().ok());
        let numbers: Option<Vec<f32>> = numbers.collect();
        let is_finite = |numbers: &Vec<f32>| numbers.iter().all(|number| number.is_finite());
        let valid = numbers.filter(is_finite);
        Ok(valid.ok_or_else(|| format!("`{}` are not numbers", escaped(line)))?)
    };
    // In another unit, the last value is below `least`. A list may be a single 0.
    let axis = |key: &str, least: f32, most: f32, unit: &str| -> Result<Vec<f32>, Defect> {
        let axis = numbers(value(key))?;
        let [first, last] = [axis.first(), axis.last()].map(|end| *end.unwrap_or(&f32::NAN));
        let is_valid = axis.is_sorted_by(|one, other| one < other) && first >= 0.0;
        ensure!(
            is_valid && (last == 0.0 || last >= least) && last <= most + 0.01,
            "its {key} is {first} to {last}, and must ascend from 0 or more to between {least} and {most} {unit}"
        );
        Ok(axis)
    };
    let axes = [
        axis("PARAM0_LIST", 2.0, 90.0, "degrees")?,
        axis("PARAM2_LIST", 2.0, 90.0, "degrees")?,
        axis("PARAM3_LIST", 7.0, 360.0, "degrees")?,
    ];
    let weights = match value("COLOR_MODEL") {
        "monochrome" => vec![[1.0; 3]],
        "rgb" => IDENTITY.to_vec(),
        "xyz" => [0, 1, 2]
            .map(|column| FROM_XYZ.map(|row| row[column]))
            .to_vec(),
        "spectrum" => {
            let wavelengths = axis("WAVELENGTH_LIST", 10.0, 1e6, "nm")?;
            omissions.extend((!have_color(&wavelengths)).then_some(Omission::Color));
            Viewing::default().rgb_weights(&wavelengths)
        }
        other => return Err(format!("its COLOR_MODEL is `{}`", escaped(other)).into()),
    };
    let count: usize = axes.iter().map(Vec::len).product();
    let mut values: Vec<[f32; 3]> = Vec::new();
    for line in rows {
        let colors = numbers(line)?;
        ensure!(
            colors.len() == weights.len(),
            "row {} has {} values, not {}",
            values.len(),
            colors.len(),
            weights.len()
        );
        let colors = colors.iter().map(|value| f64::from(*value));
        values.push(weighted_sums(colors, &weights).map(|sum| sum as f32));
    }
    ensure!(
        values.len() == count,
        "it has {} of {count} rows",
        values.len()
    );
    let reductions = value("REDUCTION_TYPE");
    let is_bilateral = reductions.contains("bilateral_symmetry");
    let at = |angles: &Angles<f32>| {
        // The table's phi_d are below half a turn.
        let phi_d = angles.phi_d.to_degrees();
        let phi_d = match is_bilateral && reductions.contains("reciprocity") {
            true => phi_d.min(180.0 - phi_d),
            false => phi_d,
        };
        let angles = [
            angles.theta_h.to_degrees(),
            angles.theta_d.to_degrees(),
            phi_d,
        ];
        interpolate(&axes, &values, angles).map(|value| value.max(0.0))
    };
    let nodes: Vec<[f32; 3]> = table_nodes().iter().map(at).collect();
    let mut table = MerlTable::from_nodes(name, &nodes)?;
    table.omissions = omissions;
    Ok(table)
}

/// Interpolates linearly between nodes, and takes the nearest ones outside of them.
fn interpolate(axes: &[Vec<f32>; 3], values: &[[f32; 3]], angles: [f32; 3]) -> [f32; 3] {
    let [size_h, size_d, _] = axes.each_ref().map(Vec::len);
    let mut sum = [0.0; 3];
    for ([h, d, p], weight) in corners(angles.map(f64::from), axes) {
        add_scaled(&mut sum, weight, &values[h + size_h * (d + size_d * p)]);
    }
    sum.map(|sum| sum as f32)
}
