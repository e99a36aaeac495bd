//! Prints `trainer/recipes/losses.csv`: the mean loss of each bundled recipe on 40 unseen procedural materials, its
//! mean loss and color error on a folder of MERL's materials, and the cross-validated loss on RGL's materials of a training at
//! quick effort. Names of recipes after the folders select rows.
//!
//!     cargo run --release -p glimpse-tests --features thorough --example recipe_losses -- MERL-networks/ RGL/ [NAME...]

use std::env;
use std::error::Error;
use std::ops::ControlFlow;

use glimpse_core::recipe::Recipe;
use glimpse_evaluation::evaluation::{Evaluator, Method};
use glimpse_fitting::bundled;
use glimpse_fitting::recipe::Metadata;
use glimpse_fitting::recipe::options::{Effort, TrainingOptions};
use glimpse_materials::basis::BasisTable;
use glimpse_materials::loss::loss_between;
use glimpse_materials::{Source, Sources};
use glimpse_training::run::train;

/// Procedural materials with a seed that no recipe is trained on.
const UNSEEN: &str = "procedural:40:4242";
/// The procedural materials that the bundled recipes are trained on.
const TRAINING: &str = "procedural:400";

fn main() -> Result<(), Box<dyn Error>> {
    let (Some(merl), Some(rgl)) = (env::args().nth(1), env::args().nth(2)) else {
        return Err(
            "two arguments are needed: pass the folders of MERL's networks and of RGL's materials"
                .into(),
        );
    };
    let procedural = Source(UNSEEN.to_owned()).load()?;
    let merl = Source(merl).load()?;
    let merl = Evaluator::new(&merl);
    let basis = BasisTable::parse(bundled::BASIS)?;
    println!("recipe,procedural,merl,merl color error,rgl cross-validated");
    let names: Vec<String> = env::args().skip(3).collect();
    let selected = |name: &str| names.is_empty() || names.iter().any(|each| each == name);
    for bundled in bundled::ALL.iter().filter(|each| selected(each.name)) {
        let recipe = bundled.recipe();
        if recipe.samples() == 0 {
            continue;
        }
        let method = Method::with_recipe(&recipe, bundled.basis().map(|_| &basis))?;
        let mut on_procedural = 0.0;
        for material in &procedural {
            let fitted = method.fit(&**material, 0)?.fitted;
            on_procedural += loss_between(&*fitted, &**material) / procedural.len() as f64;
        }
        let on_merl = merl.evaluate(&method, 0, 1)?.metrics;
        let on_rgl = cross_validated(&recipe, &rgl)?;
        println!(
            "{},{on_procedural:.4},{:.4},{:.2},{on_rgl:.4}",
            bundled.name, on_merl.loss, on_merl.delta_e
        );
    }
    Ok(())
}

/// Trains as `trainer/recipes/README.md` describes, at quick effort. Returns the held-out loss on RGL's materials.
fn cross_validated(recipe: &Recipe<'_>, rgl: &str) -> Result<f32, Box<dyn Error>> {
    let sources = [TRAINING, rgl].map(|source| Source(source.to_owned()));
    let sources = Sources::new(sources.to_vec(), &[3.0, 1.0])?;
    let lists = sources.sources.iter().map(Source::load);
    let (materials, source_shares) = sources.join(lists.collect::<Result<_, _>>()?)?;
    let metadata = Metadata::of(recipe)?;
    let trained = metadata
        .options()
        .ok_or("the recipe does not state its options")?;
    let options = TrainingOptions {
        effort: Effort::Quick,
        seed: 0,
        source_shares,
        ..trained.clone()
    };
    let learned = train(&options, &sources.label(), materials, None, &mut |_| {
        ControlFlow::Continue(())
    })?;
    let losses = learned
        .loss_predictor
        .map(|predictor| predictor.source_losses);
    match losses.as_deref() {
        Some([_, rgl]) => Ok(rgl.loss),
        _ => Err("the training has no cross-validated losses".into()),
    }
}
