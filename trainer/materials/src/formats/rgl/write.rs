//! Writing of RGL files: any isotropic BRDF, for Mitsuba's `measured` plugin.
//!
//! `rgb` is the BRDF times cos(theta_o), divided by `ndf` / (4 `sigma`). `vndf` is the density of the nodes of `rgb`.
//! At the nodes the file represents the BRDF exactly, for any positive `ndf`, `sigma` and `vndf`. The three are chosen
//! for good interpolation between nodes:
//!
//! - `ndf` is the mean of the BRDF at each theta_m, times cos(theta_m). It makes `rgb` smooth at sharp highlights.
//! - `sigma` is the projected area of these normals, as in a measurement.
//! - `vndf` is *not* the density of visible normals, but a mixture of its square root and a constant, and small below
//!   the horizon. The density itself would leave few nodes outside a sharp highlight. Importance sampling is
//!   equally good, because it uses `luminance` too.
//!
//! Below the horizon, `rgb` is extrapolated from the BRDF times cosine just above it, usually to negative values.
//! Interpolation then reaches 0 at the horizon and not at the node before it.

use rayon::prelude::*;

use super::distribution::{Densities, TableShape};
use super::normals::{NDF, Normals, SIGMA};
use super::sample_point::{
    SamplePoint, coordinate, luminance, solid_angle, times_cosine, unit_theta,
};
use super::tensor_file::{WrittenField, write};
use crate::spectrum::{PRIMARIES, WAVELENGTHS};
use crate::{NotFinite, Tabulation};

/// The number of nodes of `rgb` and `luminance` along each axis.
const SIDE: usize = 96;
/// The shape of a slice of `vndf`.
const VNDF: TableShape = TableShape {
    columns: 128,
    rows: 64,
};
/// The fraction of `vndf` that is based on visible normals. The rest is constant.
const VISIBLE_FRACTION: f64 = 0.4;

/// Tabulates a BRDF in RGB, or as a spectrum: its bands, or without bands one of the same color under D65. Returns the bytes
/// of a file, 12 MB in RGB.
///
/// # Errors
/// If the BRDF is not finite at a node.
pub(crate) fn to_rgl(table: &Tabulation<'_>, is_spectrum: bool) -> Result<Vec<u8>, NotFinite> {
    let version = env!("CARGO_PKG_VERSION");
    let description = format!("{}, by glimpse-trainer {version}", table.name);
    let has_bands = is_spectrum && !table.wavelengths.is_empty();
    let theta_i = theta_i();
    let normals = Normals::new(table.rgb)?;
    let slices: Vec<Slice> = theta_i
        .par_iter()
        .map(|theta| Slice::new(table, has_bands, f64::from(*theta), &normals))
        .collect::<Result<_, _>>()?;
    let count = theta_i.len();
    let joined = |field: fn(&Slice) -> &Vec<f32>| -> Vec<f32> {
        slices.iter().flat_map(field).copied().collect()
    };
    let (vndf, colored) = (joined(|slice| &slice.vndf), joined(|slice| &slice.colors));
    let luminance = joined(|slice| &slice.luminance);
    let floats = WrittenField::floats;
    let vndf_shape = [1, count, VNDF.rows, VNDF.columns];
    let mut fields = vec![
        WrittenField::bytes("description", description.as_bytes()),
        floats("phi_i", &[1], &[0.0]),
        floats("theta_i", &[count], &theta_i),
        floats("sigma", &[SIGMA.rows, SIGMA.columns], &normals.sigma),
        floats("ndf", &[NDF.rows, NDF.columns], &normals.ndf),
        floats("vndf", &vndf_shape, &vndf),
        floats("luminance", &[1, count, SIDE, SIDE], &luminance),
        WrittenField::bytes("jacobian", &[1]),
        WrittenField::bytes("valid", &valid_bits(&slices)),
    ];
    if is_spectrum {
        let (wavelengths, spectra) = if has_bands {
            (table.wavelengths, colored)
        } else {
            (&WAVELENGTHS[..], spectra_from_rgb(&colored))
        };
        let waves = wavelengths.len();
        fields.push(floats("wavelengths", &[waves], wavelengths));
        fields.push(floats("spectra", &[1, count, waves, SIDE, SIDE], &spectra));
    } else {
        fields.push(floats("rgb", &[1, count, 3, SIDE, SIDE], &colored));
    }
    Ok(write(&fields))
}

/// Converts the values of `rgb` to spectra.
fn spectra_from_rgb(rgb: &[f32]) -> Vec<f32> {
    let nodes = SIDE * SIDE;
    let slices = rgb.chunks_exact(3 * nodes);
    let planes = slices.flat_map(|slice| {
        PRIMARIES.iter().flat_map(move |weights| {
            (0..nodes).map(move |node| {
                let channels = weights.iter().enumerate();
                channels
                    .map(|(channel, weight)| weight * slice[channel * nodes + node])
                    .sum()
            })
        })
    });
    planes.collect()
}

/// Returns the nodes of theta_i in radians. They are denser near the horizon. The last one is at 89.9 degrees, where
/// the cosine is still accurate in f32.
fn theta_i() -> Vec<f32> {
    let evenly_spaced = (0..56).map(|step| 1.5 * f64::from(step));
    let near_horizon = [84.0, 85.0, 86.0, 87.0, 88.0, 88.5, 89.0, 89.4, 89.7, 89.9];
    let degrees = evenly_spaced.chain(near_horizon);
    degrees.map(|degrees| degrees.to_radians() as f32).collect()
}

/// Returns the field `valid`: one bit for each node, most significant bit first. The bits of nodes above the horizon
/// are 1.
fn valid_bits(slices: &[Slice]) -> Vec<u8> {
    let bits: Vec<bool> = slices
        .iter()
        .flat_map(|slice| slice.is_above_horizon.iter().copied())
        .collect();
    let bytes = bits.chunks(8).map(|bits| {
        let indexed = bits.iter().enumerate();
        indexed.fold(0, |byte, (index, bit)| {
            byte | (u8::from(*bit) << (7 - index))
        })
    });
    bytes.collect()
}

/// The fields at one node of theta_i.
struct Slice {
    vndf: Vec<f32>,
    luminance: Vec<f32>,
    /// All nodes of red, then of green, then of blue; or of each band.
    colors: Vec<f32>,
    is_above_horizon: Vec<bool>,
}

impl Slice {
    fn new(
        table: &Tabulation<'_>,
        has_bands: bool,
        theta_i: f64,
        normals: &Normals,
    ) -> Result<Self, NotFinite> {
        let ndf = |point: [f64; 2]| NDF.at(&normals.ndf, point);
        let area: f64 = SIGMA.at(&normals.sigma, [unit_theta(theta_i), 0.5]);
        let vndf = node_density(theta_i, ndf);
        let points = Densities::new(VNDF, vndf.clone()).grid_points(SIDE);
        let samples: Vec<SamplePoint> = points
            .iter()
            .map(|point| SamplePoint::new(theta_i, *point))
            .collect();
        let values = times_cosine(table.rgb, &samples)?;

        let mut luminances = Vec::with_capacity(points.len());
        for ((point, sample), value) in points.iter().zip(&samples).zip(&values) {
            // The density per solid angle of outgoing directions is converted to one per area of the unit square; see
            // `solid_angle`.
            let weighted = (luminance(*value) * sample.cos_d).max(0.0);
            let density: f64 = VNDF.at(&vndf, *point);
            let reflected = if sample.cos_o > 0.0 { weighted } else { 0.0 };
            luminances.push((4.0 * reflected * solid_angle(*point) / density) as f32);
        }
        let is_above_horizon: Vec<bool> = samples.iter().map(|sample| sample.cos_o > 0.0).collect();
        let colors = if has_bands {
            let groups = table.groups.iter();
            groups
                .map(|group| times_cosine(*group, &samples))
                .collect::<Result<_, _>>()?
        } else {
            vec![values]
        };
        let bands = if has_bands {
            table.wavelengths.len()
        } else {
            3
        };
        let planes = colors
            .iter()
            .flat_map(|values| [0, 1, 2].map(|channel| (values, channel)));
        let planes = planes.take(bands).flat_map(|(values, channel)| {
            let ratios = values.iter().zip(&points);
            let ratios = ratios.map(|(value, point)| value[channel] * 4.0 * area / ndf(*point));
            limit_negative(&ratios.collect::<Vec<f64>>(), &is_above_horizon)
        });
        Ok(Self {
            luminance: luminances,
            colors: planes.collect(),
            vndf,
            is_above_horizon,
        })
    }
}

/// Limits negative ratios to the largest magnitude above the horizon. Below the horizon a small `ndf` makes them
/// arbitrarily large, and only the first node there affects interpolation.
fn limit_negative(ratios: &[f64], is_above_horizon: &[bool]) -> Vec<f32> {
    let above = ratios
        .iter()
        .zip(is_above_horizon)
        .filter(|(_, is_above)| **is_above);
    let largest = above.fold(0.0, |largest: f64, (ratio, _)| largest.max(ratio.abs()));
    ratios
        .iter()
        .map(|ratio| ratio.max(-largest) as f32)
        .collect()
}

/// Returns the field `vndf` at a theta_i: the density of the nodes of `rgb`.
fn node_density(theta_i: f64, ndf: impl Fn([f64; 2]) -> f64) -> Vec<f32> {
    let (visible, constant): (Vec<f64>, Vec<f64>) = (0..VNDF.nodes())
        .map(|index| {
            let point = [
                coordinate(index % VNDF.columns, VNDF.columns),
                coordinate(index / VNDF.columns, VNDF.rows),
            ];
            let sample = SamplePoint::new(theta_i, point);
            let visible_normals = ndf(point) * sample.cos_d.max(0.0) * solid_angle(point);
            let horizon_weight = horizon_weight(sample.cos_o);
            (horizon_weight * visible_normals.sqrt(), horizon_weight)
        })
        .unzip();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let [visible_scale, constant_scale] = [
        VISIBLE_FRACTION / mean(&visible),
        (1.0 - VISIBLE_FRACTION) / mean(&constant),
    ];
    let terms = visible.iter().zip(&constant);
    terms
        .map(|(visible, constant)| (visible_scale * visible + constant_scale * constant) as f32)
        .collect()
}

/// Returns the relative density of nodes at a cosine of theta_o. It is small below the horizon, and largest just above
/// it, where the BRDF times cosine is nearly 0 and relative errors are large.
fn horizon_weight(cos_o: f64) -> f64 {
    let above = 1.0 / (1.0 + (-(cos_o + 0.12) / 0.04).exp());
    let near_horizon = 1.5 * (-(cos_o / 0.2).powi(2)).exp();
    (0.05 + above) * (1.0 + near_horizon)
}
