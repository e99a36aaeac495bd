//! Microfacet normals of a BRDF: how many there are at each theta_m, and what area they show.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glimpse_core::geometry::{Angles, HalfDifference};
use rayon::prelude::*;

use super::distribution::TableShape;
use super::place::{coordinate, evaluate, luminance, theta};
use crate::{Brdf, NotFinite};

/// Nodes of the tables over directions.
pub(super) const NDF: TableShape = TableShape {
    columns: 1024,
    rows: 2,
};
pub(super) const SIGMA: TableShape = TableShape {
    columns: 128,
    rows: 2,
};
/// theta_d, as shares of what is left of the quarter circle, and phi_d whose mean is a value of `ndf`.
const MEAN_THETA_D: usize = 12;
const MEAN_PHI_D: usize = 5;
/// `ndf` is nowhere less than this share of that of a white surface as bright.
const LEAST_NDF: f64 = 1e-3;
/// Cosine of theta_m below which `ndf` does not go on falling: it must stay above 0.
const LEAST_COSINE: f64 = 1e-4;

/// What is common to all theta_i.
pub(super) struct Normals {
    pub(super) ndf: Vec<f32>,
    pub(super) sigma: Vec<f32>,
}

impl Normals {
    pub(super) fn of(brdf: &(impl Brdf + ?Sized)) -> Result<Self, NotFinite> {
        let thetas: Vec<f64> = (0..NDF.columns)
            .map(|column| theta(coordinate(column, NDF.columns)))
            .collect();
        let mean = thetas.par_iter().map(|theta| mean(brdf, *theta));
        let mut normals: Vec<f64> = mean.collect::<Result<_, _>>()?;
        for (value, theta) in normals.iter_mut().zip(&thetas) {
            *value *= theta.cos().max(LEAST_COSINE);
        }
        let facing = area(&normals, &thetas, 0.0);
        for (value, theta) in normals.iter_mut().zip(&thetas) {
            let least = LEAST_NDF * theta.cos().max(LEAST_COSINE);
            // A black one has no normals of its own.
            let own = if facing > 0.0 { *value / facing } else { 0.0 };
            *value = own.max(least);
        }
        let sigma = (0..SIGMA.columns).into_par_iter();
        let sigma = sigma
            .map(|column| area(&normals, &thetas, theta(coordinate(column, SIGMA.columns))) as f32);
        let twice = |row: Vec<f32>| row.repeat(2);
        Ok(Self {
            ndf: twice(normals.iter().map(|value| *value as f32).collect()),
            sigma: twice(sigma.collect()),
        })
    }
}

/// Mean luminance of a BRDF at a theta_h.
fn mean(brdf: &(impl Brdf + ?Sized), theta_h: f64) -> Result<f64, NotFinite> {
    let at: Vec<HalfDifference<f32>> = (0..MEAN_THETA_D * MEAN_PHI_D)
        .map(|index| {
            let share = 0.95 * coordinate(index / MEAN_PHI_D, MEAN_THETA_D);
            HalfDifference::from_angles(Angles {
                theta_h: theta_h as f32,
                theta_d: (share * (FRAC_PI_2 - theta_h)) as f32,
                phi_d: (PI * coordinate(index % MEAN_PHI_D, MEAN_PHI_D)) as f32,
            })
        })
        .collect();
    let values = evaluate(brdf, &at)?;
    let sum: f64 = values
        .iter()
        .map(|value| luminance(value.map(f64::from)).max(0.0))
        .sum();
    Ok(sum / at.len() as f64)
}

/// Area that normals show towards a theta_i: the integral of their density times the cosine to it.
fn area(normals: &[f64], thetas: &[f64], theta_i: f64) -> f64 {
    const PHIS: usize = 64;
    let (sin_i, cos_i) = theta_i.sin_cos();
    let step = 1.0 / (normals.len() - 1) as f64;
    let rings = normals.iter().zip(thetas).map(|(density, theta)| {
        let (sin, cos) = theta.sin_cos();
        let shown: f64 = (0..PHIS)
            .map(|phi| {
                let phi = PI * (phi as f64 + 0.5) / PHIS as f64;
                (sin_i * sin * phi.cos() + cos_i * cos).max(0.0)
            })
            .sum();
        // d theta = pi u du, and pi u = sqrt(2 pi theta).
        density * shown * TAU / PHIS as f64 * sin * (TAU * theta).sqrt() * step
    });
    rings.sum()
}
