//! Materials: what is measured, or measured-looking, and where to read it from.

mod brdf;
mod error;
mod fitted;
mod format;
mod identity;
mod left_out;
mod mapped;
mod merl;
mod name;
mod nbrdf;
mod pab;
mod procedural;
mod rgl;
mod sensor;
mod source;
mod sources;

pub use crate::basis::angles_of;
pub use brdf::Brdf;
pub use error::{NotFinite, SourceError};
pub use fitted::{BasisFile, Convention, FittedMaterial};
pub use format::Format;
pub use identity::{Identity, digest};
pub use left_out::LeftOut;
pub use merl::{MerlTable, TabulateError, table_nodes, to_merl, write_merl};
pub use nbrdf::{NeuralBrdf, to_nbrdf};
pub use pab::{PabSet, pab_endings, read_pab, to_pab};
pub use procedural::Procedural;
pub use rgl::{RglMeasurement, to_rgl};
pub use sensor::quantised;
pub use source::{Source, WHOLLY_CHECKED};
pub use sources::{Joined, Portion, ShareError, Sources};

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::NeuralParameters;

/// A measured material: a BRDF that can be looked up anywhere, with its derivative.
pub trait Material: Send + Sync {
    /// Its name: the stem of the file it was read from.
    fn name(&self) -> &str;

    /// The BRDF in linear RGB, sr^-1 (not times the cosine), at angles in radians.
    fn brdf(&self, angles: Angles<f32>) -> [f32; 3];

    /// The BRDF, and its derivative by theta_h, theta_d and phi_d for each channel.
    fn brdf_with_derivative(&self, angles: Angles<f32>) -> ([f32; 3], [[f32; 3]; 3]);

    /// The same at many angles at once; `found` is as long as `angles`.
    fn brdf_batch_with_derivative(
        &self,
        angles: &[Angles<f32>],
        found: &mut [([f32; 3], [[f32; 3]; 3])],
    ) {
        for (angles, found) in angles.iter().zip(found) {
            *found = self.brdf_with_derivative(*angles);
        }
    }

    /// True if the BRDF is the same, but for rounding, wherever light and sensor are exchanged: at
    /// phi_d + pi.
    fn is_reciprocal(&self) -> bool {
        false
    }

    /// The weights, if it is a network of the model Neural, which files of networks hold to the bit.
    fn network(&self) -> Option<NeuralParameters<f32>> {
        None
    }

    /// The BRDF at many places at once, for pictures and metrics.
    fn brdf_batch(&self, at: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        for (at, brdf) in at.iter().zip(brdf) {
            *brdf = self.brdf(angles_of(at));
        }
    }

    /// Lets go of what of its file lies in memory, after a look at many places; it is read again
    /// where it is needed again. Most materials are small, and do nothing.
    fn release(&self) {}
}
