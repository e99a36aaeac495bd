//! A firmware without a board: it fits measurements that every machine computes alike, and prints
//! the result and what it took. One binary for each recipe, and two where readings are lost;
//! `tests/run firmware` builds and runs them.
//!
//! On a host the library alone is built: tests compare the device's numbers with its.

#![no_std]

#[cfg(all(not(target_os = "none"), feature = "libm"))]
pub mod judge;
#[cfg(target_os = "none")]
pub mod machine;
#[cfg(target_os = "none")]
pub mod report;

use glimpse_core::geometry::Angles;
use glimpse_core::scan::{Reading, Residual};

/// The recipes that are tried: n = 8, and 20 steps or 5 components.
pub mod recipes {
    /// Phong.
    pub static PHONG: &[u8] = include_bytes!("../../../trainer/recipes/phong-n8.recipe");
    /// Cook-Torrance.
    pub static COOK_TORRANCE: &[u8] =
        include_bytes!("../../../trainer/recipes/cook-torrance-n8.recipe");
    /// Neural.
    pub static NEURAL: &[u8] = include_bytes!("../../../trainer/recipes/neural-n8.recipe");
    /// Linear.
    pub static LINEAR: &[u8] = include_bytes!("../../../trainer/recipes/linear-n8.recipe");

    /// Those that complete the readings: n = 8, and one step from where the completion leads, or for
    /// Linear none.
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

    /// Those with more samples.
    pub mod large {
        /// Neural, n = 32.
        pub static NEURAL_32: &[u8] =
            include_bytes!("../../../trainer/recipes/completed/neural-n32.recipe");
        /// Linear, n = 32.
        pub static LINEAR_32: &[u8] =
            include_bytes!("../../../trainer/recipes/completed/linear-n32.recipe");
        /// Neural, n = 64, trained for its costs only (procedural:40, effort quick).
        pub static NEURAL_64: &[u8] = include_bytes!("../recipes/neural-n64.recipe");
        /// Linear, n = 64, trained for its costs only.
        pub static LINEAR_64: &[u8] = include_bytes!("../recipes/linear-n64.recipe");
    }

    /// The compact basis of Linear's completed recipes.
    pub static BASIS: &[u8] = include_bytes!("../../../trainer/recipes/linear.basis24");

    /// Those that complete readings of which some may be missing: n = 16.
    pub mod masked {
        /// Neural.
        pub static NEURAL: &[u8] =
            include_bytes!("../../../trainer/recipes/masked/neural-n16.recipe");
        /// Linear.
        pub static LINEAR: &[u8] =
            include_bytes!("../../../trainer/recipes/masked/linear-n16.recipe");
    }
}

/// A made-up material: a diffuse color, and a highlight of two widths.
#[derive(Clone, Copy, Debug)]
pub struct Material {
    /// sr^-1, linear RGB.
    pub diffuse: [f32; 3],
    /// The height of the highlight, sr^-1.
    pub highlight: f32,
    /// How narrow it is; half as high at theta_h = 0.64 / sqrt(sharpness).
    pub sharpness: f32,
}

impl Material {
    /// The one whose fit is counted.
    pub const COUNTED: Self = Self {
        diffuse: [0.12, 0.05, 0.03],
        highlight: 0.9,
        sharpness: 40.0,
    };

    /// What a sensor sees of it. Sums, products and quotients only, which every machine rounds
    /// alike.
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

/// What a sensor sees of the material whose fit is counted.
#[must_use]
pub fn measure(angles: Angles<f32>) -> Reading {
    Material::COUNTED.measure(angles)
}

/// Which readings of a masked recipe are lost where some are: every third one.
#[must_use]
pub const fn is_lost(index: u16) -> bool {
    index % 3 == 1
}

/// What stops a fit before it begins; no recipe here does.
#[derive(Debug)]
pub struct Refused;

/// How well a fit explains its readings, as numbers that are compared.
#[must_use]
pub fn residual_bits(residual: &Residual) -> [u32; 2] {
    [residual.mean.to_bits(), residual.worst.to_bits()]
}
