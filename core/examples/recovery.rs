//! A scanner with a monochrome sensor, a missing reading and a power failure, which then scans with a recipe of another
//! model: `cargo run -p glimpse-core --example recovery`

mod common;
use glimpse_core::error::Error;
use glimpse_core::fit::AnyModel;
use glimpse_core::gonio::Reading;
use glimpse_core::recipe::{Recipe, max_samples, memory_words};
use glimpse_core::scan::{Residual, Saved, Scan};

/// Linear, which tolerates missing readings, and Neural.
pub(crate) static RECIPES: [&[u8]; 2] = [
    include_bytes!("recipes/linear-n16-masked.recipe"),
    include_bytes!("recipes/neural-n8.recipe"),
];
pub(crate) const MEMORY_WORDS: usize = memory_words(&RECIPES);
pub(crate) const SLOT_BYTES: usize = Saved::slot_bytes(max_samples(&RECIPES));

/// Boots and scans. Returns the residual of the fit, or None if the power fails after `power_fails_after` readings.
pub(crate) fn boot(
    recipe: &[u8],
    memory: &mut [f32],
    flash: &mut [[u8; SLOT_BYTES]; 2],
    power_fails_after: usize,
) -> Result<Option<Residual>, Error> {
    let mut scan = Scan::<AnyModel>::new(Recipe::parse(recipe)?, memory)?;
    let (mut saved, restored) = Saved::restore([&flash[0], &flash[1]], &mut scan);
    println!("{restored:?}"); // readings from before the power failure
    let mut store = |slot: usize, bytes: &[u8]| {
        flash[slot][..bytes.len()].copy_from_slice(bytes);
        Ok::<_, Error>(())
    };
    let mut readings = restored.unwrap_or_default();
    while let Some((index, directions)) = scan.next_pending() {
        // The sensor has one channel.
        let red = (index != 11).then(|| common::material(&directions)[0]);
        match red {
            _ if readings == power_fails_after => return Ok(None),
            None => scan.skip(index)?, // the sensor cannot read this sample
            Some(brdf) => {
                scan.record(index, Reading::monochrome(brdf))?;
                saved.write(&scan, &mut [0; SLOT_BYTES], &mut store)?;
                readings += 1;
            }
        }
    }
    let mut fit = scan.fit()?;
    while !fit.advance(8).is_complete() {}
    let residual = fit.finish()?.residual();
    saved.clear(&mut store)?; // otherwise the next boot continues with this material
    Ok(Some(residual))
}

pub(crate) fn main() -> Result<(), Error> {
    let (mut memory, mut flash) = ([0.0; MEMORY_WORDS], [[0; SLOT_BYTES]; 2]);
    for (recipe, power_fails_after) in [(0, 9), (0, usize::MAX), (1, usize::MAX)] {
        let residual = boot(RECIPES[recipe], &mut memory, &mut flash, power_fails_after)?;
        println!("{residual:?}");
    }
    Ok(())
}
