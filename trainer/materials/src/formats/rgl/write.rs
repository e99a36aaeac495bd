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
//! Below the horizon, `rgb` is extrapolated from the BRDF times cosine just above it, but not to negative values: renderers
//! would interpolate to some of them. Many nodes are just above the horizon, so that this has little effect there.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glimpse_core::geometry::{Angles, HalfDifference};
use rayon::prelude::*;

use super::distribution::{Densities, TableShape};
use super::sample_point::{
    SamplePoint, coordinate, luminance, solid_angle, theta, times_cosine, unit_theta,
};
use super::tensor_file::{WrittenField, write};
use crate::spectrum::PRIMARIES;
use crate::{Brdf, NotFinite, Tabulation};

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
            (&PRIMARIES.0[..], spectra_from_rgb(&colored))
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
        PRIMARIES.1.iter().flat_map(move |weights| {
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
            let weighted = luminance(*value) * sample.cos_d;
            let density: f64 = VNDF.at(&vndf, *point);
            let reflected = if sample.cos_o > 0.0 { weighted } else { 0.0 };
            luminances.push((4.0 * reflected * solid_angle(*point) / density) as f32);
        }
        let (colors, bands) = if has_bands {
            let groups = table.groups.iter();
            let colors = groups.map(|group| times_cosine(*group, &samples));
            (colors.collect::<Result<_, _>>()?, table.wavelengths.len())
        } else {
            (vec![values], 3)
        };
        let planes = colors
            .iter()
            .flat_map(|values| [0, 1, 2].map(|channel| (values, channel)));
        let planes = planes.take(bands).flat_map(|(values, channel)| {
            let pairs = values.iter().zip(&points);
            pairs.map(move |(value, point)| (value[channel] * 4.0 * area / ndf(*point)) as f32)
        });
        Ok(Self {
            luminance: luminances,
            colors: planes.collect(),
            vndf,
            is_above_horizon: samples.iter().map(|sample| sample.cos_o > 0.0).collect(),
        })
    }
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
    let near_horizon = 4.0 * (-(cos_o / 0.08).powi(2)).exp();
    (0.05 + above) * (1.0 + near_horizon)
}

/// The shape of the field `ndf`.
const NDF: TableShape = TableShape {
    columns: 1024,
    rows: 2,
};
/// The shape of the field `sigma`.
const SIGMA: TableShape = TableShape {
    columns: 128,
    rows: 2,
};
/// The number of theta_d over which each value of `ndf` is averaged. They cover 95 percent of \[0, pi/2 - theta_h\].
const THETA_D_COUNT: usize = 12;
/// The number of phi_d over which each value of `ndf` is averaged.
const PHI_D_COUNT: usize = 5;
/// The lower limit of `ndf` / cos(theta_m). For a diffuse surface, this ratio is 3 / (2 pi), about 0.5.
const MIN_NDF: f64 = 1e-3;
/// The lower limit of cos(theta_m) in `ndf`, because `ndf` must be positive.
const MIN_COSINE: f64 = 1e-4;

/// The fields of microfacet normals, which do not depend on theta_i.
struct Normals {
    ndf: Vec<f32>,
    sigma: Vec<f32>,
}

impl Normals {
    fn new(brdf: &dyn Brdf) -> Result<Self, NotFinite> {
        let thetas: Vec<f64> = (0..NDF.columns)
            .map(|column| theta(coordinate(column, NDF.columns)))
            .collect();
        let means = thetas.par_iter().map(|theta| mean_luminance(brdf, *theta));
        let mut ndf: Vec<f64> = means.collect::<Result<_, _>>()?;
        for (value, theta) in ndf.iter_mut().zip(&thetas) {
            *value *= theta.cos().max(MIN_COSINE);
        }
        let total_area = projected_area(&ndf, &thetas, 0.0);
        for (value, theta) in ndf.iter_mut().zip(&thetas) {
            let lower_limit = MIN_NDF * theta.cos().max(MIN_COSINE);
            // The area is 0 for a black BRDF.
            let normalized = if total_area > 0.0 {
                *value / total_area
            } else {
                0.0
            };
            *value = normalized.max(lower_limit);
        }
        let sigma = (0..SIGMA.columns).into_par_iter();
        let sigma = sigma.map(|column| {
            projected_area(&ndf, &thetas, theta(coordinate(column, SIGMA.columns))) as f32
        });
        // One row for each end of the range of phi. The rows of an isotropic material are equal.
        let two_rows = |row: Vec<f32>| row.repeat(2);
        Ok(Self {
            ndf: two_rows(ndf.iter().map(|value| *value as f32).collect()),
            sigma: two_rows(sigma.collect()),
        })
    }
}

/// Returns the mean luminance of a BRDF at a theta_h in radians.
fn mean_luminance(brdf: &dyn Brdf, theta_h: f64) -> Result<f64, NotFinite> {
    let at: Vec<HalfDifference<f32>> = (0..THETA_D_COUNT * PHI_D_COUNT)
        .map(|index| {
            let fraction = 0.95 * coordinate(index / PHI_D_COUNT, THETA_D_COUNT);
            HalfDifference::from_angles(Angles {
                theta_h: theta_h as f32,
                theta_d: (fraction * (FRAC_PI_2 - theta_h)) as f32,
                phi_d: (PI * coordinate(index % PHI_D_COUNT, PHI_D_COUNT)) as f32,
            })
        })
        .collect();
    let values = brdf.written_values_at(&at)?;
    let sum: f64 = values
        .iter()
        .map(|value| luminance(value.map(f64::from)))
        .sum();
    Ok(sum / at.len() as f64)
}

/// Returns the projected area of the normals towards a theta_i: the integral of their density times the cosine,
/// where it is positive.
fn projected_area(ndf: &[f64], thetas: &[f64], theta_i: f64) -> f64 {
    const PHI_STEPS: usize = 64;
    let (sin_i, cos_i) = theta_i.sin_cos();
    let step = 1.0 / (ndf.len() - 1) as f64;
    let rings = ndf.iter().zip(thetas).map(|(density, theta)| {
        let (sin, cos) = theta.sin_cos();
        let projection: f64 = (0..PHI_STEPS)
            .map(|phi| {
                let phi = PI * (phi as f64 + 0.5) / PHI_STEPS as f64;
                (sin_i * sin * phi.cos() + cos_i * cos).max(0.0)
            })
            .sum();
        // d theta = pi u du, and pi u = sqrt(2 pi theta).
        density * projection * TAU / PHI_STEPS as f64 * sin * (TAU * theta).sqrt() * step
    });
    rings.sum()
}
