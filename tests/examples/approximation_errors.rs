//! Prints the mean errors of fits against the materials of a folder: of the fits themselves, of the mean of both orders of
//! light and sensor, and of the shading models that approximate them.
//!
//!     cargo run --release -p glimpse-tests --example approximation_errors -- RECIPE MATERIALS/

use std::error::Error;
use std::path::Path;
use std::{env, fs};

use glimpse_core::recipe::Recipe;
use glimpse_materials::basis::Basis;
use glimpse_materials::{Material, NeuralBrdf, Reciprocal, Source};
use glimpse_trainer::evaluation::{Evaluator, Method};
use glimpse_trainer::shading::{ShadingModel, fit};

const MODELS: [(&str, ShadingModel); 3] = [
    ("principled", ShadingModel::Principled),
    ("gltf", ShadingModel::Gltf),
    ("materialx", ShadingModel::StandardSurface),
];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [recipe_path, folder] = &arguments[..] else {
        return Err("two arguments are needed: pass a recipe and a folder of materials".into());
    };
    let bytes = fs::read(recipe_path)?;
    let recipe = Recipe::parse(&bytes)?;
    let basis = fs::read(Path::new(recipe_path).with_extension("basis")).ok();
    let basis = basis.map(|bytes| Basis::from_bytes(&bytes)).transpose()?;
    let method = Method::ours(&recipe, basis.as_ref())?;
    let materials = Source(folder.clone()).load()?;
    let evaluator = Evaluator::new(&materials);
    let mut sums: Vec<(&str, [f64; 2])> = Vec::new();
    for index in 0..materials.len() {
        let fitted = method.fit(&*materials[index], 0)?;
        let mut errors = vec![("the fit", evaluator.compare(index, &fitted)?.0)];
        let network = fitted
            .network()
            .map(|network| NeuralBrdf::new(String::new(), network));
        if let Some(mean) = network.as_ref().and_then(|network| Reciprocal::of(network)) {
            let mean: &dyn Material = &mean;
            errors.push(("mean of both orders", evaluator.compare(index, mean)?.0));
        }
        for (name, model) in MODELS {
            let shading = fit(&fitted, model)?;
            errors.push((name, evaluator.compare(index, &shading)?.0));
        }
        sums.resize(errors.len(), ("", [0.0; 2]));
        for ((name, sums), (label, error)) in sums.iter_mut().zip(errors) {
            *name = label;
            sums[0] += error.loss / materials.len() as f64;
            sums[1] += error.delta_e / materials.len() as f64;
        }
    }
    println!("approximation,loss,color error");
    for (name, [loss, delta_e]) in sums {
        println!("{name},{loss:.5},{delta_e:.2}");
    }
    Ok(())
}
