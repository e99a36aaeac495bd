//! What the choice of elementary functions costs: fits the recipes to a family of materials on the
//! host, with the functions that this was built with, and prints the mean loss at directions that
//! were not measured. With the feature `micromath` the fit is micromath's; the loss is by libm.
//!
//! ```sh
//! cargo run --release --manifest-path embedded-demo/fits/Cargo.toml --example loss
//! cargo run --release --manifest-path embedded-demo/fits/Cargo.toml --example loss --features micromath
//! ```

use std::error::Error;

use glimpse_core::angles::{Angles, HalfDifference};
use glimpse_core::fit::Workspace;
use glimpse_core::loss::cosine_weighted_log_error;
use glimpse_core::model::{CookTorrance, Model, Neural, ParameterSet, Phong};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;
use glimpse_fits::{Material, SAMPLES, recipes};

/// Materials in the family.
const MATERIALS: u32 = 64;
/// Directions that each is judged at.
const DIRECTIONS: u32 = 1024;

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
    ] {
        println!("{functions}.{name}.loss={loss:.4}");
    }
    Ok(())
}

/// The mean over all materials.
fn mean_loss<M: Model>(recipe: &[u8]) -> Result<f64, Box<dyn Error>> {
    let recipe = Recipe::parse(recipe).map_err(|error| error.to_string())?;
    let mut sum = 0.0;
    for index in 0..MATERIALS {
        let material = of_family(index);
        let mut workspace = Workspace::<M>::new();
        let mut scan =
            Scan::<M, SAMPLES>::new(recipe, &mut workspace).map_err(|error| error.to_string())?;
        for angles in recipe.pattern() {
            scan.record(material.measure(angles))
                .map_err(|error| error.to_string())?;
        }
        while !scan.advance_fit(usize::MAX).is_complete() {}
        sum += loss::<M>(scan.parameters(), &material);
    }
    Ok(sum / f64::from(MATERIALS))
}

/// The n-th of a family, dull and glossy, dark and bright.
fn of_family(index: u32) -> Material {
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

/// The loss of fitted parameters, in double precision.
fn loss<M: Model>(fitted: &M::Parameters<f32>, material: &Material) -> f64 {
    let mut parameters = M::Parameters::<f64>::filled(0.0);
    for (parameter, value) in parameters.iter_mut().zip(fitted.iter()) {
        *parameter = f64::from(*value);
    }
    let directions = (0..DIRECTIONS).map(direction);
    let errors: Vec<f64> = directions
        .filter_map(|angles| {
            let at = HalfDifference::from_angles(angles);
            let cosine = at.cos_theta_i();
            if cosine <= 0.0 || at.cos_theta_o() <= 0.0 {
                return None;
            }
            let measured = material.measure(Angles {
                theta_h: angles.theta_h as f32,
                theta_d: angles.theta_d as f32,
                phi_d: angles.phi_d as f32,
            });
            let modelled = M::brdf::<f64>(&parameters, &at);
            let loss = cosine_weighted_log_error(
                measured.brdf.map(f64::from),
                modelled,
                cosine,
                1.0 / 3.0,
            );
            Some(loss.error.value())
        })
        .collect();
    errors.iter().sum::<f64>() / errors.len() as f64
}

/// The n-th of evenly spread directions (an additive recurrence by powers of the plastic ratio's
/// analogue in three dimensions).
fn direction(index: u32) -> Angles<f64> {
    use std::f64::consts::{FRAC_PI_2, PI};
    let coordinate = |step: f64| (0.5 + step * f64::from(index)).fract();
    Angles {
        theta_h: FRAC_PI_2 * coordinate(0.819_172_513_396_164_4),
        theta_d: FRAC_PI_2 * coordinate(0.671_043_606_703_789_2),
        phi_d: PI * coordinate(0.549_700_477_901_970_3),
    }
}
