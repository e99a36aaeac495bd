//! Cost of the elementary functions in accuracy: fits the recipes to a family of materials on a host, and prints the
//! mean loss at directions without readings. With the feature `micromath` the fit uses micromath's functions. The loss
//! always uses libm's.
//!
//! ```sh
//! cargo run --release --manifest-path embedded-demo/bench/Cargo.toml --example loss
//! cargo run --release --manifest-path embedded-demo/bench/Cargo.toml --example loss --features micromath
//! ```

use std::error::Error;

use glimpse_bench::evaluation::loss;
use glimpse_bench::{Material, recipes};
use glimpse_core::fit::ScanModel;
use glimpse_core::model::{CookTorrance, Model, Neural, Phong};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;

/// Number of materials in the family.
const MATERIALS: u32 = 64;

fn main() -> Result<(), Box<dyn Error>> {
    let functions = if cfg!(feature = "micromath") {
        "micromath"
    } else {
        "libm"
    };
    for (name, loss) in [
        ("phong", mean_loss::<Phong>(recipes::PHONG)?),
        (
            "cook-torrance",
            mean_loss::<CookTorrance>(recipes::COOK_TORRANCE)?,
        ),
        ("neural", mean_loss::<Neural>(recipes::NEURAL)?),
        (
            "phong-completed",
            mean_loss::<Phong>(recipes::completed::PHONG)?,
        ),
        (
            "cook-torrance-completed",
            mean_loss::<CookTorrance>(recipes::completed::COOK_TORRANCE)?,
        ),
        (
            "neural-completed",
            mean_loss::<Neural>(recipes::completed::NEURAL)?,
        ),
    ] {
        println!("{functions}.{name}.loss={loss:.4}");
    }
    Ok(())
}

/// Returns the mean loss over all materials.
fn mean_loss<M: Model + ScanModel>(recipe: &[u8]) -> Result<f64, Box<dyn Error>> {
    let recipe = Recipe::parse(recipe)?;
    let mut sum = 0.0;
    for index in 0..MATERIALS {
        let material = family_member(index);
        let mut memory = vec![0.0; recipe.memory_words()];
        let mut scan = Scan::<M>::new(recipe, &mut memory)?;
        for (index, angles) in (0..).zip(recipe.pattern()) {
            scan.record(index, material.measure(angles))?;
        }
        let mut fit = scan.fit()?;
        while !fit.advance(u32::MAX).is_complete() {}
        let values: Vec<f32> = fit.finish()?.values().collect();
        sum += loss::<M>(&values, &material);
    }
    Ok(sum / f64::from(MATERIALS))
}

/// Returns the nth material of the family, which varies in gloss, brightness and tint.
fn family_member(index: u32) -> Material {
    let spread = |step: f32| (step * (index as f32 + 0.5)).fract();
    let brightness = 0.3 * spread(0.618_034);
    let tint = spread(0.754_877_7);
    let gloss = spread(0.569_840_3);
    Material {
        diffuse: [brightness, brightness * tint, brightness * (1.0 - tint)].map(|f| 0.01 + f),
        highlight: 0.05 + 4.0 * gloss * gloss,
        sharpness: 4.0 + 200.0 * gloss,
    }
}
