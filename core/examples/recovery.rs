//! A scanner with a monochrome sensor, a missing reading and a power failure, which then scans with a recipe of another
//! model: `cargo run -p glimpse-core --example recovery`

pub(crate) mod common;
use common::flash::Flash;
use glimpse_core::error::Error;
use glimpse_core::fit::AnyModel;
use glimpse_core::gonio::Reading;
use glimpse_core::recipe::{Recipe, memory_words};
use glimpse_core::scan::{Residual, Scan};
use glimpse_core::store::{Layout, Store};

/// Linear, which tolerates missing readings, and Neural.
pub(crate) static RECIPES: [&[u8]; 2] = [
    include_bytes!("recipes/linear-n16-masked.recipe"),
    include_bytes!("recipes/neural-n8.recipe"),
];
pub(crate) const MEMORY_WORDS: usize = memory_words(&RECIPES);
/// The place of the store: two areas of two sectors.
const LAYOUT: Layout = Layout {
    start: 0,
    area_bytes: 1024,
};

/// Boots and scans. Returns the residual of the fit, or None if the power fails after `power_fails_after` readings.
pub(crate) fn boot(
    recipe: &[u8],
    memory: &mut [f32],
    flash: &mut Flash,
    power_fails_after: usize,
) -> Result<Option<Residual>, Error> {
    let mut scan = Scan::<AnyModel>::new(Recipe::parse(recipe)?, memory)?;
    let mut store = Store::mount(flash, LAYOUT, scan.recipe())?;
    let mut readings = usize::from(store.restore(&mut scan)?); // from before the power failure
    println!("{readings} readings are saved");
    while let Some((index, directions)) = scan.next_pending() {
        // The sensor has one channel.
        let red = (index != 11).then(|| common::material(&directions)[0]);
        match red {
            _ if readings == power_fails_after => return Ok(None),
            None => {
                scan.skip(index)?; // the sensor cannot read this sample
                store.save(index, None, true)?;
            }
            Some(brdf) => {
                let reading = Reading::monochrome(brdf);
                scan.record(index, reading)?;
                store.save(index, Some(reading), true)?;
                readings += 1;
            }
        }
    }
    let mut fit = scan.fit()?;
    while !fit.advance(8).is_complete() {}
    let residual = fit.finish()?.residual();
    store.clear()?; // otherwise the next boot continues with this material
    Ok(Some(residual))
}

pub(crate) fn main() -> Result<(), Error> {
    let (mut memory, mut flash) = ([0.0; MEMORY_WORDS], Flash::new(4));
    for (recipe, power_fails_after) in [(0, 9), (0, usize::MAX), (1, usize::MAX)] {
        let residual = boot(RECIPES[recipe], &mut memory, &mut flash, power_fails_after)?;
        println!("{residual:?}");
    }
    Ok(())
}
