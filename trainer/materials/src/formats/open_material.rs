//! BRDF look-up tables of ASAM OpenMATERIAL 3D, JSON files `NAME_brdf.xompt`: rows of the wavelength in m, theta_i, theta_o, phi_o in
//! radians, and the BRDF in sr^-1, not times the cosine. The light is at phi_i = 0, and a mirror reflects to phi_o = pi.

use std::collections::BTreeMap;
use std::path::Path;

use glimpse_core::checksum::crc_32;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::pab::{Incidence, PabSet, THETA_I, outgoing_angles, pair};
use crate::color::product;
use crate::error::{Defect, ensure, read_error};
use crate::spectrum::{PRIMARIES, Viewing, have_color, weighted_sums};
use crate::untrusted::{escaped_json_error, read_at_most};
use crate::{Material, NotFinite, Omission, SourceError, Tabulation};

/// The largest length of a file in bytes.
const MAX_BYTES: u64 = 1 << 29;
/// Nanometers per meter.
const NM: f64 = 1e9;
/// The largest theta in radians, that of transmitted light, with a rounding error.
const MAX_THETA: f64 = std::f64::consts::PI + 1e-5;
/// The relative difference below which a row's wavelength is a listed one.
const WAVELENGTH_TOLERANCE: f64 = 1e-6;

#[derive(Serialize, Deserialize)]
struct File<M> {
    metadata: M,
    brdf: Table,
}

#[derive(Deserialize)]
struct Metadata {
    name: String,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Table {
    wavelengths: Vec<f64>,
    lookup_table: Vec<[Option<f64>; 5]>,
}

/// Tabulates a BRDF at the directions of a goniophotometer: its bands, or else spectra of a BRDF in RGB.
///
/// # Errors
/// If the BRDF is not finite at a direction.
pub(super) fn to_open_material(table: &Tabulation<'_>) -> Result<Vec<u8>, NotFinite> {
    let columns = table.columns();
    let (written, primaries) = &*PRIMARIES;
    let nm = match table.wavelengths {
        [] => &written[..],
        wavelengths => wavelengths,
    };
    let slices = THETA_I.par_iter().map(|theta_i| {
        let radians = |degrees: f64| rounded(degrees.to_radians(), 1e6);
        let mut outgoing = outgoing_angles(f64::from(*theta_i));
        outgoing
            .iter_mut()
            .for_each(|angles| *angles = angles.map(radians));
        outgoing.sort_by(|[a, b], [c, d]| a.total_cmp(c).then(b.total_cmp(d)));
        outgoing.dedup();
        let theta_i = radians(f64::from(*theta_i));
        let at = outgoing
            .iter()
            .map(|[theta, phi]| pair(theta_i.to_degrees(), theta.to_degrees(), phi.to_degrees()));
        let at: Vec<_> = at.collect();
        let mut spectra = vec![Vec::new(); at.len()];
        for column in &columns {
            for (rgb, spectrum) in column.written_values_at(&at)?.into_iter().zip(&mut spectra) {
                match table.wavelengths {
                    [] => spectrum.extend(primaries.iter().flat_map(|row| product(&[*row], rgb))),
                    _ => spectrum.extend(rgb),
                }
            }
        }
        Ok((theta_i, outgoing, spectra))
    });
    let slices: Vec<_> = slices.collect::<Result<_, NotFinite>>()?;
    let meters = nm.iter().map(|nm| rounded(f64::from(*nm), 1e3) / NM);
    let wavelengths: Vec<f64> = meters.collect();
    let mut rows = Vec::new();
    for (band, wavelength) in wavelengths.iter().enumerate() {
        for (theta_i, outgoing, spectra) in &slices {
            for ([theta, phi], spectrum) in outgoing.iter().zip(spectra) {
                let value = f64::from((spectrum[band] * 1e7).round().max(0.0)) / 1e7;
                rows.push([*wavelength, *theta_i, *theta, *phi, value].map(Some));
            }
        }
    }
    let metadata = serde_json::json!({
        "name": table.name,
        "uuid": format!("00000000-0000-0000-0000-{:012x}", crc_32(table.name.as_bytes())),
        "materialVersion": "1.0.0",
        "openMaterial3dVersion": "1.1.0",
        "copyrights": ["not stated"],
        "license": "not stated",
        "authors": ["not stated"],
        "sources": format!("glimpse-trainer {}", env!("CARGO_PKG_VERSION")),
    });
    let brdf = Table {
        wavelengths,
        lookup_table: rows,
    };
    Ok(serde_json::to_vec(&File { metadata, brdf }).expect("numbers and text have a JSON form"))
}

fn rounded(value: f64, scale: f64) -> f64 {
    (value * scale).round() / scale
}

/// Reads a material.
///
/// # Errors
/// If the file cannot be read or is damaged, or directions lack some of its wavelengths.
pub(super) fn read_open_material(path: &Path) -> Result<Box<dyn Material>, SourceError> {
    let bytes = read_at_most(path, MAX_BYTES).map_err(read_error(path))?;
    let file: File<Metadata> = serde_json::from_slice(&bytes).map_err(|error| {
        Defect::in_file(path)(format!(
            "it is not a BRDF of OpenMATERIAL ({})",
            escaped_json_error(&error)
        ))
    })?;
    let wavelengths = file.brdf.wavelengths.iter();
    let nm: Vec<f32> = wavelengths.map(|meters| (meters * NM) as f32).collect();
    let incidences = incidences(&file.brdf, &nm).map_err(Defect::in_file::<Defect>(path))?;
    let incidences = incidences
        .into_iter()
        .map(|incidence| (path.to_owned(), incidence));
    let set = PabSet::new(file.metadata.name, incidences.collect());
    let mut set = set.map_err(Defect::in_file(path))?;
    set.omissions
        .extend((!have_color(&nm)).then_some(Omission::Color));
    set.resampled(path)
}

/// Returns the values of a table. `nm` has its wavelengths in nm.
fn incidences(table: &Table, nm: &[f32]) -> Result<Vec<Incidence>, Defect> {
    let [first, last] = [nm.first(), nm.last()].map(|nm| *nm.unwrap_or(&f32::NAN));
    ensure!(
        first >= 1.0 && last <= 17.16e6 && nm.is_sorted_by(|one, other| one < other),
        "its wavelengths are {first} to {last} nm, and must ascend from 1 nm or more to at most 17.16 mm, in m"
    );
    let weights = Viewing::default().rgb_weights(nm);
    // By theta_i, and by theta_o and phi_o, in degrees. Positive floats have the order of their bits.
    let mut spectra: BTreeMap<u64, BTreeMap<[u64; 2], Vec<f64>>> = BTreeMap::new();
    for (index, row) in table.lookup_table.iter().enumerate() {
        let [
            Some(wavelength),
            Some(theta_i),
            Some(theta_o),
            Some(phi),
            Some(value),
        ] = *row
        else {
            continue;
        };
        let theta = theta_i.max(theta_o).max(0.5 * phi.abs());
        ensure!(
            theta_i.min(theta_o) >= 0.0 && theta <= MAX_THETA,
            "row {index} of its lookupTable has theta_i {theta_i}, theta_o {theta_o} and phi_o {phi}, which must be radians: \
             0 to pi/2, 0 to pi/2 and 0 to 2 pi"
        );
        // Adding 0 replaces -0.
        let [theta_i, theta_o, phi] = [theta_i, theta_o, phi].map(|angle| angle.to_degrees() + 0.0);
        let is_listed = |listed: &f64| (listed - wavelength).abs() <= WAVELENGTH_TOLERANCE * listed;
        let band = table.wavelengths.iter().position(is_listed);
        let slice = spectra.entry(theta_i.to_bits()).or_default();
        let spectrum = slice.entry([theta_o, phi].map(f64::to_bits));
        let spectrum = spectrum.or_insert_with(|| vec![f64::NAN; weights.len()]);
        // NaN marks a missing value.
        match band.map(|band| &mut spectrum[band]) {
            Some(missing) if missing.is_nan() => *missing = value,
            _ => {
                return Err(format!(
                    "the wavelength {wavelength:e} in row {index} of its lookupTable is not listed, or repeats for its directions"
                ).into());
            }
        }
    }
    let slices = spectra.into_iter().map(|(theta_i, slice)| {
        let values = slice.into_iter().map(|([theta, phi], spectrum)| {
            let known = spectrum.iter().filter(|value| !value.is_nan()).count();
            ensure!(
                known == weights.len(),
                "a direction has {known} of {} wavelengths",
                weights.len()
            );
            let rgb = weighted_sums(spectrum.into_iter(), &weights).map(|sum| sum as f32);
            Ok(([theta, phi].map(f64::from_bits), rgb))
        });
        Ok(Incidence {
            theta_i: f64::from_bits(theta_i),
            phi_i: 0.0,
            values: values.collect::<Result<_, String>>()?,
            set_theta_i: Vec::new(),
        })
    });
    slices.collect()
}
