//! Prints `trainer/recipes/losses.csv`: the mean loss of each bundled recipe on 40 unseen procedural materials, and on
//! the materials of two folders.
//!
//!     cargo run --release -p glimpse-tests --example recipe_losses -- MERL-networks/ RGL/

use std::env;
use std::error::Error;

use glimpse_materials::basis::Basis;
use glimpse_materials::loss::loss_between;
use glimpse_materials::{Material, Source};
use glimpse_trainer::bundled::{self, BundledRecipe};
use glimpse_trainer::evaluation::Method;
use rayon::prelude::*;

/// Procedural materials with a seed that no recipe is trained on.
const UNSEEN: &str = "procedural:40:4242";

fn main() -> Result<(), Box<dyn Error>> {
    let folders: Vec<String> = env::args().skip(1).collect();
    let [merl, rgl] = &folders[..] else {
        return Err("two arguments are needed: pass the folder of MERL's networks and the folder of RGL's files".into());
    };
    let sets = [UNSEEN, merl, rgl].map(|source| Source(source.to_owned()).load());
    let [procedural, merl, rgl] = sets;
    let sets = [procedural?, merl?, rgl?];
    let basis = Basis::from_compact_bytes(bundled::BASIS)?;
    println!("recipe,procedural,merl,rgl");
    for bundled in bundled::ALL {
        print!("{}", bundled.name);
        for set in &sets {
            print!(",{:.4}", mean_loss(bundled, &basis, set)?);
        }
        println!();
    }
    Ok(())
}

fn mean_loss(
    bundled: &BundledRecipe,
    basis: &Basis,
    materials: &[Box<dyn Material>],
) -> Result<f64, Box<dyn Error>> {
    let recipe = bundled.recipe()?;
    let basis = bundled.basis().map(|_| basis);
    let method = Method::ours(&recipe, basis)?;
    let losses: Result<Vec<f64>, _> = materials
        .par_iter()
        .map(|material| {
            let fitted = method.fit(&**material, 0)?;
            Ok::<_, glimpse_trainer::evaluation::EvaluationError>(loss_between(
                &fitted,
                &**material,
            ))
        })
        .collect();
    let losses = losses?;
    Ok(losses.iter().sum::<f64>() / losses.len() as f64)
}
