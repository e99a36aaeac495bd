//! Materials at a pool of directions, with highlight warps, and principal components at those directions.
//!
//! A material is evaluated on first use, so that training starts before thousands of materials or large files are read.
//! The order of evaluation does not affect the values.

use glimpse_materials::half_differences;
use std::sync::{Arc, OnceLock};

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::numeric::Scalar;
use glimpse_fitting::linear::ComponentsAt;
use glimpse_kernels::components::{ComponentTable, HEADER_OCTETS};
use glimpse_kernels::lanes::{Octet, OctetDirections, WIDTH};
use glimpse_kernels::samples::{OctetRgb, transpose_rgb};
use glimpse_materials::Material;
use glimpse_materials::basis::BasisTable;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::highlight_warp::HighlightWarp;

/// The number of terms of a smooth field: a factor that augments a material and varies slowly with the directions. It
/// may, for example, brighten grazing angles or large theta_h.
pub const FIELD_TERMS: usize = 5;

/// Returns the terms of a smooth field. Each is invariant under exchange of light and sensor, so a BRDF times the
/// exponential of their weighted sum is reciprocal.
#[must_use]
pub fn field_terms<S: Scalar>(direction: &HalfDifference<S>) -> [S; FIELD_TERMS] {
    let one = S::constant(1.0);
    let grazing = one - direction.dz;
    let squared = grazing * grazing;
    let tilt = one - direction.hz * direction.hz;
    [
        grazing + grazing,
        squared * squared * S::constant(4.0),
        tilt + tilt,
        (direction.dx * direction.dx - direction.dy * direction.dy) * tilt * S::constant(2.0),
        tilt * grazing * S::constant(3.0),
    ]
}

/// Materials at a pool of directions, each with every highlight warp.
pub struct WarpedPool {
    /// The directions in octets.
    pub octet_directions: Vec<OctetDirections>,
    angles: Vec<Angles<f32>>,
    /// The smooth field terms at the directions.
    pub fields: Vec<[Octet; FIELD_TERMS]>,
    /// The materials.
    pub materials: Arc<[Box<dyn Material>]>,
    /// The directions at which unwarped materials are evaluated, for each highlight warp.
    directions: Vec<Vec<HalfDifference<f32>>>,
    /// The BRDF of each material with each highlight warp, evaluated on first use.
    values: Vec<Vec<OnceLock<Vec<OctetRgb>>>>,
}

impl WarpedPool {
    /// Creates a pool of directions, truncated to whole octets. The first `warped_count` materials have every highlight
    /// warp, the others only the first one.
    #[must_use]
    pub fn new(
        materials: Arc<[Box<dyn Material>]>,
        warped_count: usize,
        mut angles: Vec<Angles<f32>>,
    ) -> Self {
        angles.truncate(angles.len() / WIDTH * WIDTH);
        let warps = HighlightWarp::all();
        let warps = if warped_count > 0 {
            &warps[..]
        } else {
            &warps[..1]
        };
        let directions_of = |warp: &HighlightWarp| {
            half_differences(angles.iter().map(|angles| warp.angles(*angles).0))
        };
        let values = (0..materials.len()).map(|index| {
            let count = if index < warped_count { warps.len() } else { 1 };
            (0..count).map(|_| OnceLock::new()).collect()
        });
        let values = values.collect();
        let octets = directions_of(&HighlightWarp::IDENTITY);
        let octets = octets.chunks(WIDTH).map(|directions| {
            let mut fields = [Octet::default(); FIELD_TERMS];
            for (lane, direction) in directions.iter().enumerate() {
                for (octet, value) in fields.iter_mut().zip(field_terms(direction)) {
                    octet.0[lane] = value;
                }
            }
            (Octet::transpose(directions), fields)
        });
        let (octet_directions, fields) = octets.unzip();
        Self {
            octet_directions,
            fields,
            directions: warps.iter().map(directions_of).collect(),
            angles,
            materials,
            values,
        }
    }

    /// Returns the number of octets.
    #[must_use]
    pub fn octet_count(&self) -> usize {
        self.octet_directions.len()
    }

    /// Returns the number of highlight warps of a material.
    #[must_use]
    pub fn warps(&self, material: usize) -> usize {
        self.values[material].len()
    }

    /// Returns the BRDF of a material with a highlight warp, in octets, sr⁻¹.
    #[must_use]
    pub fn values(&self, material: usize, highlight_warp: usize) -> &[OctetRgb] {
        self.values[material][highlight_warp].get_or_init(|| {
            let (material, directions) =
                (&self.materials[material], &self.directions[highlight_warp]);
            let brdf = material.values_at(directions);
            brdf.chunks(WIDTH).map(transpose_rgb).collect()
        })
    }

    /// Draws a block of successive octets, at least `count` directions in total. The pool is random, so that a block is as
    /// good as scattered octets, and much faster to read. Blocks continue at the pool's start.
    #[must_use]
    pub fn draw(&self, count: usize, random: &mut ChaCha8Rng) -> Vec<u32> {
        let octets = self.octet_count() as u32;
        let first = random.random_range(0..octets);
        let block = first..first + count.div_ceil(WIDTH) as u32;
        block.map(|octet| octet % octets).collect()
    }

    /// Returns the principal components at the directions.
    #[must_use]
    pub fn components(&self, basis: &BasisTable) -> ComponentTable {
        let components = basis.components();
        let octets = self.angles.par_chunks(WIDTH).flat_map_iter(|angles| {
            let at = ComponentsAt::new(basis, angles.to_vec());
            let entry = move |entry: usize| {
                Octet(std::array::from_fn(|lane| match entry {
                    0 => at.cos_theta_i[lane],
                    1 => at.cosines[lane].value,
                    2 => at.mean[lane].value,
                    _ => at.row(lane)[entry - HEADER_OCTETS],
                }))
            };
            (0..HEADER_OCTETS + components).map(entry)
        });
        ComponentTable {
            components,
            octets: octets.collect(),
        }
    }
}
