//! Materials for virtual scanners.

use glimpse_fitting::recipe::ReadingNoise;
use glimpse_fitting::scanner::VirtualScanner;
use glimpse_materials::{Material, Procedural};

/// Returns a material that no recipe is trained on.
#[must_use]
pub fn unseen_material(index: usize) -> Procedural {
    Procedural::new(index, 0xFEED)
}

/// Returns a virtual scanner without noise.
#[must_use]
pub fn noiseless_scanner(material: &dyn Material) -> VirtualScanner<'_> {
    VirtualScanner::new(Some(material), ReadingNoise::default(), 0)
}
