//! Microfacet normals of a BRDF: their distribution over theta_m, and their projected area.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glimpse_core::geometry::{Angles, HalfDifference};
use rayon::prelude::*;

use super::distribution::TableShape;
use super::sample_point::{coordinate, luminance, theta};
use crate::{Brdf, NotFinite};

/// The shape of the field `ndf`.
pub(super) const NDF: TableShape = TableShape {
    columns: 1024,
    rows: 2,
};
/// The shape of the field `sigma`.
pub(super) const SIGMA: TableShape = TableShape {
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

/// The fields that do not depend on theta_i.
pub(super) struct Normals {
    pub(super) ndf: Vec<f32>,
    pub(super) sigma: Vec<f32>,
}

impl Normals {
    pub(super) fn new(brdf: &dyn Brdf) -> Result<Self, NotFinite> {
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
    let values = brdf.finite_values_at(&at)?;
    let sum: f64 = values
        .iter()
        .map(|value| luminance(value.map(f64::from)).max(0.0))
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
