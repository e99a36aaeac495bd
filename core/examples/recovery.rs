//! A scanner with a monochrome sensor, a missing reading and a power failure, which then scans with a recipe of another
//! model: `cargo run -p glimpse-core --example recovery`

mod common;
use std::error::Error;

use glimpse_core::fit::AnyModel;
use glimpse_core::recipe::{Recipe, max_samples, memory_words};
use glimpse_core::scan::{Reading, Residual, Saved, Scan};

/// Linear, which tolerates missing readings, and Neural.
pub(crate) static RECIPES: [&[u8]; 2] = [
    include_bytes!("recipes/linear-n16-masked.recipe"),
    include_bytes!("recipes/neural-n8.recipe"),
];
const SAMPLES: usize = max_samples(&RECIPES);
pub(crate) const MEMORY_WORDS: usize = memory_words(&RECIPES);
pub(crate) const FLASH_BYTES: usize = Saved::<SAMPLES>::BYTES;

/// Boots and scans. Returns the residual of the fit, or None if the power fails after `power_fails_after` readings.
pub(crate) fn boot(
    recipe: &[u8],
    memory: &mut [f32],
    flash: &mut [u8],
    power_fails_after: usize,
) -> Result<Option<Residual>, Box<dyn Error>> {
    let recipe = Recipe::parse(recipe)?;
    let mut scan = Scan::<AnyModel>::new(recipe, memory)?;
    let mut saved = Saved::<SAMPLES>::read(flash, &recipe).unwrap_or(Saved::new(&recipe));
    for (index, reading) in saved.readings() {
        scan.record(*index, *reading)?; // from before the power failure
    }
    while let Some((index, directions)) = scan.next_pending() {
        match common::monochrome(index, &directions) {
            _ if saved.readings().len() == power_fails_after => return Ok(None),
            None => scan.skip(index)?, // the sensor cannot read this sample
            Some(brdf) => {
                scan.record(index, Reading::monochrome(brdf))?;
                saved.insert(index, Reading::monochrome(brdf))?;
                saved.write(flash)?;
            }
        }
    }
    let mut fit = scan.fit()?;
    while !fit.advance(8).is_complete() {}
    let residual = fit.finish()?.residual();
    saved.clear(); // otherwise the next boot continues with this material
    saved.write(flash)?;
    Ok(Some(residual))
}

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let (mut memory, mut flash) = ([0.0; MEMORY_WORDS], [0; FLASH_BYTES]);
    for (recipe, power_fails_after) in [(0, 9), (0, usize::MAX), (1, usize::MAX)] {
        let residual = boot(RECIPES[recipe], &mut memory, &mut flash, power_fails_after)?;
        println!("{residual:?}");
    }
    Ok(())
}
