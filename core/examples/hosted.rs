//! A scan on a PC: `cargo run -p glimpse-core --example hosted`

mod common;
use glimpse_core::gonio::Reading;
use glimpse_core::model::Neural;
use glimpse_core::recipe::{Recipe, memory_words};
use glimpse_core::scan::Scan;

static RECIPE: &[u8] = include_bytes!("recipes/neural-n8.recipe");

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut memory = [0.0; memory_words(&[RECIPE])]; // sized at compile time
    let mut scan = Scan::<Neural>::new(Recipe::parse(RECIPE)?, &mut memory)?;
    while let Some((index, directions)) = scan.next_pending() {
        scan.record(index, Reading::new(common::material(&directions)))?;
    }
    let mut fit = scan.fit()?;
    while !fit.advance(8).is_complete() {}
    println!("{:?}", fit.finish()?.brdf(&common::in_plane(30.0, 40.0))); // linear RGB, sr^-1
    Ok(())
}
