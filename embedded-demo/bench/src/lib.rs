//! Benchmark firmware: each binary fits one recipe to synthetic readings, which every machine computes identically, and
//! prints the result and its cost. `tests/run firmware` builds and runs the binaries.
//!
//! On a host only the library is built, so tests can compare the device's results with the host's.

#![no_std]

#[cfg(target_os = "none")]
pub mod machine;
#[cfg(target_os = "none")]
pub mod report;
#[cfg(target_os = "none")]
pub mod stack;

use glimpse_core::geometry::Angles;
use glimpse_core::gonio::Reading;

/// Recipes of the benchmarks.
pub mod recipes {
    /// Defines a recipe for each file, by its path in the repository.
    macro_rules! bundled {
        ($($name:ident = $path:literal;)*) => {$(
            #[doc = $path]
            pub static $name: &[u8] = include_bytes!(concat!("../../../", $path));
        )*};
    }

    bundled! {
        // n = 8. A descent has 20 steps, and Linear has 5 components.
        PHONG = "trainer/recipes/paper/phong-n8.recipe";
        COOK_TORRANCE = "trainer/recipes/paper/cook-torrance-n8.recipe";
        NEURAL = "trainer/recipes/paper/neural-n8.recipe";
        LINEAR = "trainer/recipes/paper/linear-n8.recipe";
        BASIS = "trainer/recipes/linear.basis24";
        // A completion: n = 8, then one step of descent, except for Linear.
        COMPLETED_PHONG = "trainer/recipes/completed/phong-n8.recipe";
        COMPLETED_COOK_TORRANCE = "trainer/recipes/completed/cook-torrance-n8.recipe";
        COMPLETED_NEURAL = "trainer/recipes/completed/neural-n8.recipe";
        COMPLETED_LINEAR = "trainer/recipes/completed/linear-n8.recipe";
        // A completion that tolerates missing readings: n = 16.
        MASKED_NEURAL = "trainer/recipes/masked/neural-n16.recipe";
        MASKED_LINEAR = "trainer/recipes/masked/linear-n16.recipe";
        // n = 64, trained for benchmarks only: 40 procedural materials, `--effort quick`.
        NEURAL_64 = "embedded-demo/bench/recipes/neural-n64.recipe";
        LINEAR_64 = "embedded-demo/bench/recipes/linear-n64.recipe";
    }
}

/// Returns the reading of a synthetic material at these angles: a diffuse color, and a highlight of two widths. The
/// computation uses only sums, products and quotients, which every machine rounds identically.
#[must_use]
pub fn measure(angles: Angles<f32>) -> Reading {
    let lobe = |sharpness: f32| {
        let falloff = 1.0 + sharpness * angles.theta_h * angles.theta_h;
        1.0 / (falloff * falloff)
    };
    let grazing = 1.0 + 0.2 * angles.theta_d * angles.theta_d;
    let highlight = 0.9 * ((8.0 * lobe(40.0) + lobe(4.0)) / 9.0) * grazing;
    Reading::new([0.12 + highlight, 0.05 + highlight, 0.03 + 0.9 * highlight])
}

/// Returns true for the readings that are missing in `*-lost` benchmarks: every third one.
#[must_use]
pub const fn is_missing(index: u16) -> bool {
    index % 3 == 1
}
