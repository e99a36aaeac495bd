//! Scans a made-up material by each model: `cargo run -p glimpse-core --example scan`

mod common;

use common::{angles, in_plane, material};
use glimpse_core::fit::AnyModel;
use glimpse_core::recipe::{Recipe, memory_words};
use glimpse_core::scan::{Reading, Residual, Scan};

pub(crate) const RECIPES: [&[u8]; 4] = [
    include_bytes!("recipes/linear-n8.recipe"),
    include_bytes!("recipes/neural-n8.recipe"),
    include_bytes!("recipes/cook-torrance-n8.recipe"),
    include_bytes!("recipes/phong-n8.recipe"),
];

/// A scan from the first reading to the fitted material.
pub(crate) fn scan(bytes: &[u8]) -> Result<Residual, Box<dyn std::error::Error>> {
    let mut memory = [0.0; memory_words(&RECIPES)]; // in firmware a static
    let mut scan = Scan::<AnyModel>::new(Recipe::parse(bytes)?, &mut memory)?;
    println!(
        "\n{}\n  theta_i  theta_o      phi  read",
        scan.recipe().model()
    );
    while let Some((index, at)) = scan.next_pending() {
        let read = material(&at); // a scanner moves its arms there and reads its sensor
        let [theta_i, theta_o, phi] = angles(&at);
        println!("  {theta_i:7.1}  {theta_o:7.1}  {phi:7.1}  {read:.4?}");
        scan.record(index, Reading::new(read))?;
    }

    let mut fit = scan.fit()?;
    while !fit.advance(8).is_complete() {} // between two slices a firmware does its other work
    let fitted = fit.finish()?;

    println!("  theta_i  theta_o  fitted, and in truth");
    for degrees in [-60.0, -30.0, 0.0, 20.0, 30.0, 40.0, 60.0] {
        let at = in_plane(30.0, degrees);
        let Some(brdf) = fitted.brdf(&at) else {
            // Linear's coefficients become a BRDF by the basis that belongs to the recipe.
            let coefficients = fitted.values().collect::<Vec<_>>();
            println!("  no basis is here; coefficients: {coefficients:.3?}");
            break;
        };
        println!("       30  {degrees:7}  {brdf:.4?}  {:.4?}", material(&at));
    }
    let residual = fitted.residual();
    let (mean, worst, expected) = (residual.mean, residual.worst, fitted.expected_loss());
    println!("  residual {mean:.4}, at worst {worst:.4}; to expect elsewhere: {expected:.4?}");
    Ok(residual)
}

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut recipes = RECIPES.iter();
    recipes.try_for_each(|recipe| scan(recipe).map(|_| ()))
}
