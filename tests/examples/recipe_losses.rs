//! Prints `trainer/recipes/losses.csv`: the mean loss of each bundled recipe on 40 unseen procedural materials, and its
//! mean loss and color error on the materials of a folder. Names of recipes after the folder select rows.
//!
//!     cargo run --release -p glimpse-tests --example recipe_losses -- MERL-networks/ [NAME...]

use std::env;
use std::error::Error;

use glimpse_materials::Source;
use glimpse_materials::basis::Basis;
use glimpse_materials::loss::loss_between;
use glimpse_trainer::bundled;
use glimpse_trainer::evaluation::{Evaluator, Method};

/// Procedural materials with a seed that no recipe is trained on.
const UNSEEN: &str = "procedural:40:4242";

fn main() -> Result<(), Box<dyn Error>> {
    let Some(merl) = env::args().nth(1) else {
        return Err("an argument is needed: pass the folder of MERL's networks".into());
    };
    let procedural = Source(UNSEEN.to_owned()).load()?;
    let merl = Source(merl).load()?;
    let merl = Evaluator::new(&merl);
    let basis = Basis::from_compact_bytes(bundled::BASIS)?;
    println!("recipe,procedural,merl,merl color error");
    let names: Vec<String> = env::args().skip(2).collect();
    let selected = |name: &str| names.is_empty() || names.iter().any(|each| each == name);
    for bundled in bundled::ALL.iter().filter(|each| selected(each.name)) {
        let recipe = bundled.recipe()?;
        let method = Method::with_recipe(&recipe, bundled.basis().map(|_| &basis))?;
        let mut on_procedural = 0.0;
        for material in &procedural {
            let fitted = method.fit(&**material, 0)?;
            on_procedural += loss_between(&fitted, &**material) / procedural.len() as f64;
        }
        let on_merl = merl.evaluate(&method, 0, 1)?.metrics;
        println!(
            "{},{on_procedural:.4},{:.4},{:.2}",
            bundled.name, on_merl.loss, on_merl.delta_e
        );
    }
    Ok(())
}
