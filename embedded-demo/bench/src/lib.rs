//! Benchmark firmware: each binary fits one recipe to synthetic readings, which every machine computes identically, and
//! prints the result and its cost. `tests/run firmware` builds and runs the binaries.
//!
//! On a host only the library is built, so tests can compare the device's results with the host's.

#![no_std]

#[cfg(target_os = "none")]
pub mod machine;
#[cfg(target_os = "none")]
pub mod report;

use glimpse_core::geometry::Angles;
use glimpse_core::gonio::Reading;
use glimpse_core::scan::Residual;

/// Recipes of the benchmarks: n = 8. A descent has 20 steps, and Linear has 5 components.
pub mod recipes {
    /// Phong.
    pub static PHONG: &[u8] = include_bytes!("../../../trainer/recipes/paper/phong-n8.recipe");
    /// Cook-Torrance.
    pub static COOK_TORRANCE: &[u8] =
        include_bytes!("../../../trainer/recipes/paper/cook-torrance-n8.recipe");
    /// Neural.
    pub static NEURAL: &[u8] = include_bytes!("../../../trainer/recipes/paper/neural-n8.recipe");
    /// Linear.
    pub static LINEAR: &[u8] = include_bytes!("../../../trainer/recipes/paper/linear-n8.recipe");

    /// Recipes with a completion: n = 8, then one step of descent, except for Linear.
    pub mod completed {
        /// Phong.
        pub static PHONG: &[u8] =
            include_bytes!("../../../trainer/recipes/completed/phong-n8.recipe");
        /// Cook-Torrance.
        pub static COOK_TORRANCE: &[u8] =
            include_bytes!("../../../trainer/recipes/completed/cook-torrance-n8.recipe");
        /// Neural.
        pub static NEURAL: &[u8] =
            include_bytes!("../../../trainer/recipes/completed/neural-n8.recipe");
        /// Linear.
        pub static LINEAR: &[u8] =
            include_bytes!("../../../trainer/recipes/completed/linear-n8.recipe");
    }

    /// Recipes with more samples.
    pub mod large {
        /// Neural, n = 64, trained for benchmarks only: 40 procedural materials, `--effort quick`.
        pub static NEURAL_64: &[u8] = include_bytes!("../recipes/neural-n64.recipe");
        /// Linear, n = 64, trained likewise.
        pub static LINEAR_64: &[u8] = include_bytes!("../recipes/linear-n64.recipe");
    }

    /// The compact basis of Linear's completed recipes.
    pub static BASIS: &[u8] = include_bytes!("../../../trainer/recipes/linear.basis24");

    /// Recipes with a completion that tolerates missing readings: n = 16.
    pub mod masked {
        /// Neural.
        pub static NEURAL: &[u8] =
            include_bytes!("../../../trainer/recipes/masked/neural-n16.recipe");
        /// Linear.
        pub static LINEAR: &[u8] =
            include_bytes!("../../../trainer/recipes/masked/linear-n16.recipe");
    }
}

/// A synthetic material: a diffuse color, and a highlight of two widths.
#[derive(Clone, Copy, Debug)]
pub struct Material {
    /// Diffuse BRDF in linear RGB, sr^-1.
    pub diffuse: [f32; 3],
    /// Peak of the highlight, sr^-1.
    pub highlight: f32,
    /// Sharpness of the highlight, rad^-2. It falls to half its peak at theta_h = 0.64 / sqrt(sharpness).
    pub sharpness: f32,
}

impl Material {
    /// The material of the benchmarks.
    pub const BENCHMARK: Self = Self {
        diffuse: [0.12, 0.05, 0.03],
        highlight: 0.9,
        sharpness: 40.0,
    };

    /// Returns the reading of this material at these angles. The computation uses only sums, products and quotients,
    /// which every machine rounds identically.
    #[must_use]
    pub fn measure(&self, angles: Angles<f32>) -> Reading {
        let lobe = |sharpness: f32| {
            let falloff = 1.0 + sharpness * angles.theta_h * angles.theta_h;
            1.0 / (falloff * falloff)
        };
        let grazing = 1.0 + 0.2 * angles.theta_d * angles.theta_d;
        let lobes = (8.0 * lobe(self.sharpness) + lobe(0.1 * self.sharpness)) / 9.0;
        let highlight = self.highlight * lobes * grazing;
        let [red, green, blue] = self.diffuse;
        Reading::new([red + highlight, green + highlight, blue + 0.9 * highlight])
    }
}

/// Returns the reading of the benchmark material at these angles.
#[must_use]
pub fn measure(angles: Angles<f32>) -> Reading {
    Material::BENCHMARK.measure(angles)
}

/// Returns true for the readings that are missing in `*-lost` benchmarks: every third one.
#[must_use]
pub const fn is_missing(index: u16) -> bool {
    index % 3 == 1
}

/// Error of a benchmark. It does not occur with the recipes of this crate.
#[derive(Debug)]
pub struct BenchError;

/// Returns the bits of the residual, for comparison.
#[must_use]
pub fn residual_bits(residual: &Residual) -> [u32; 2] {
    [residual.mean.to_bits(), residual.worst.to_bits()]
}
