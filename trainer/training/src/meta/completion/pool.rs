//! Materials at many directions, also with other highlights, and principal components there.
//!
//! A material is evaluated when it is first asked for: of thousands, or of large files, training begins
//! before all were read. Values depend on nothing else, so that the order has no say in them.

use std::sync::{Arc, OnceLock};

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_kernels::components::{ComponentTable, HEAD};
use glimpse_kernels::lanes::{Octet, OctetAt, WIDTH};
use glimpse_kernels::samples::{OctetRgb, transpose_rgb};
use glimpse_materials::Material;
use glimpse_materials::basis::{Basis, widened};
use rayon::prelude::*;

use super::field::{FIELD, field_at};
use super::highlight_warp::HighlightWarp;

/// Materials at some directions, octet by octet.
type Values = Vec<OctetRgb>;

/// Materials at uniform valid directions, each with every highlight warp.
pub struct WarpedPool {
    /// The directions, eight by eight.
    pub at: Vec<OctetAt>,
    angles: Vec<Angles<f32>>,
    /// Smooth fields there.
    pub fields: Vec<[Octet; FIELD]>,
    materials: Arc<[Box<dyn Material>]>,
    /// Where materials are looked up for each highlight warp to appear at the directions.
    places: Vec<Vec<HalfDifference<f32>>>,
    /// The materials' BRDF, of each with each highlight warp, as far as it was asked for.
    values: Vec<Vec<OnceLock<Values>>>,
}

impl WarpedPool {
    /// Materials at some directions, cut to octets: the first `warped` of them with every highlight warp, the
    /// others with the first one alone.
    #[must_use]
    pub fn new(
        materials: Arc<[Box<dyn Material>]>,
        warped: usize,
        warps: &[HighlightWarp],
        mut angles: Vec<Angles<f32>>,
    ) -> Self {
        angles.truncate(angles.len() / WIDTH * WIDTH);
        let places: Vec<Vec<HalfDifference<f32>>> = warps
            .iter()
            .map(|highlight_warp| {
                let warped = angles.iter().map(|angles| highlight_warp.angles(*angles).0);
                warped.map(HalfDifference::from_angles).collect()
            })
            .collect();
        let values = (0..materials.len()).map(|index| {
            let count = if index < warped { places.len() } else { 1 };
            (0..count).map(|_| OnceLock::new()).collect()
        });
        let values = values.collect();
        let fields = angles
            .chunks(WIDTH)
            .map(|angles| {
                let mut fields = [Octet::default(); FIELD];
                for (lane, angles) in angles.iter().enumerate() {
                    for (octet, value) in fields
                        .iter_mut()
                        .zip(field_at(&HalfDifference::from_angles(*angles)))
                    {
                        octet.0[lane] = value;
                    }
                }
                fields
            })
            .collect();
        let at = angles.chunks(WIDTH).map(|angles| {
            let at: Vec<_> = angles
                .iter()
                .copied()
                .map(HalfDifference::from_angles)
                .collect();
            Octet::transpose(&at)
        });
        Self {
            at: at.collect(),
            angles,
            fields,
            materials,
            places,
            values,
        }
    }

    /// How many octets there are.
    #[must_use]
    pub fn octets(&self) -> usize {
        self.at.len()
    }

    /// With how many warps a material is there.
    #[must_use]
    pub fn warps(&self, material: usize) -> usize {
        self.values[material].len()
    }

    /// A material with a highlight warp, octet by octet.
    #[must_use]
    pub fn values(&self, material: usize, highlight_warp: usize) -> &[OctetRgb] {
        self.values[material][highlight_warp].get_or_init(|| {
            let (material, places) = (&self.materials[material], &self.places[highlight_warp]);
            let mut brdf = vec![[0.0; 3]; places.len()];
            material.brdf_batch(places, &mut brdf);
            material.release();
            brdf.chunks(WIDTH).map(transpose_rgb).collect()
        })
    }

    /// Principal components at its directions.
    #[must_use]
    pub fn components(&self, basis: &Basis) -> ComponentTable {
        let components = basis.components();
        let rows: Vec<Vec<f32>> = self
            .angles
            .par_iter()
            .map(|angles| {
                let found = basis.look_up(widened(angles));
                let at = HalfDifference::from_angles(*angles);
                let cosine = at.cos_theta_i();
                let [mean, ..] = found.center();
                let head = [cosine, cosine * at.cos_theta_o(), mean as f32];
                let row = found.components.iter().map(|component| component[0] as f32);
                head.into_iter().chain(row).collect()
            })
            .collect();
        let octets = rows.chunks(WIDTH).flat_map(|rows| {
            (0..HEAD + components)
                .map(move |entry| Octet(std::array::from_fn(|lane| rows[lane][entry])))
        });
        ComponentTable {
            components,
            octets: octets.collect(),
        }
    }
}
