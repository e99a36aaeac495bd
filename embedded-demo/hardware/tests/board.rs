//! Fits on a board: bits of the host, and cycles.

#![no_std]
#![no_main]

use cortex_m_rt as _; // start-up code

mod expected {
    include!(concat!(env!("OUT_DIR"), "/expected.rs"));
}

#[embedded_test::tests]
mod tests {
    use cortex_m::peripheral::{DWT, Peripherals};
    use glimpse_bench::{measure, recipes};
    use glimpse_core::error::Error;
    use glimpse_core::fit::{Linear, ScanModel};
    use glimpse_core::model::{CookTorrance, Neural, Phong};
    use glimpse_core::recipe::{Recipe, memory_words};
    use glimpse_core::scan::Scan;

    use crate::expected;

    const MEMORY: usize = memory_words(&[
        recipes::COMPLETED_PHONG,
        recipes::COMPLETED_COOK_TORRANCE,
        recipes::COMPLETED_NEURAL,
        recipes::COMPLETED_LINEAR,
    ]);

    /// Fits, compares the values with the host's, and prints the cycles.
    fn check_fit<K: ScanModel>(recipe: &[u8], expected: &[u32]) -> Result<(), Error> {
        let mut memory = [0.0; MEMORY];
        let recipe = Recipe::parse(recipe)?;
        let mut scan = Scan::<K>::new(recipe, &mut memory)?;
        for (index, angles) in (0..).zip(recipe.pattern()) {
            scan.record(index, measure(angles))?;
        }
        let start = DWT::cycle_count();
        let mut fit = scan.fit()?;
        while !fit.advance(1000).is_complete() {}
        let fitted = fit.finish()?;
        semihosting::println!("cycles: {}", DWT::cycle_count().wrapping_sub(start));
        let bits = fitted.values().map(f32::to_bits);
        assert!(bits.eq(expected.iter().copied()));
        Ok(())
    }

    #[test]
    fn fits_have_the_bits_of_the_host() -> Result<(), Error> {
        let mut peripherals = Peripherals::take().unwrap();
        peripherals.DCB.enable_trace();
        peripherals.DWT.enable_cycle_counter();
        check_fit::<Phong>(recipes::COMPLETED_PHONG, expected::PHONG)?;
        check_fit::<CookTorrance>(recipes::COMPLETED_COOK_TORRANCE, expected::COOK_TORRANCE)?;
        check_fit::<Neural>(recipes::COMPLETED_NEURAL, expected::NEURAL)?;
        check_fit::<Linear>(recipes::COMPLETED_LINEAR, expected::LINEAR)
    }
}
