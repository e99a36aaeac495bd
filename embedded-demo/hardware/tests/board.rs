//! Fits on a board: bits of the host, cycles, saved readings, and damaged recipes. Each test begins with a reset.

#![no_std]
#![no_main]

use cortex_m_rt as _; // start-up code

mod expected {
    include!(concat!(env!("OUT_DIR"), "/expected.rs"));
}

#[embedded_test::tests]
mod tests {
    use cortex_m::peripheral::{DWT, Peripherals};
    use glimpse_bench::{measure, recipes::completed};
    use glimpse_core::error::Error;
    use glimpse_core::fit::{Linear, ScanModel};
    use glimpse_core::model::{CookTorrance, Neural, Phong};
    use glimpse_core::recipe::{Recipe, max_samples, memory_words};
    use glimpse_core::scan::{Saved, Scan};

    use crate::expected;

    const RECIPES: [&[u8]; 4] = [
        completed::PHONG,
        completed::COOK_TORRANCE,
        completed::NEURAL,
        completed::LINEAR,
    ];
    type Memory = [f32; memory_words(&RECIPES)];
    const MEMORY: Memory = [0.0; memory_words(&RECIPES)];

    #[init]
    fn init() -> DWT {
        let mut peripherals = Peripherals::take().unwrap();
        peripherals.DCB.enable_trace();
        peripherals.DWT.enable_cycle_counter();
        peripherals.DWT
    }

    fn record<K: ScanModel>(scan: &mut Scan<'_, K>) -> Result<(), Error> {
        let recipe = *scan.recipe();
        let mut samples = (0..).zip(recipe.pattern());
        samples.try_for_each(|(index, angles)| scan.record(index, measure(angles)).map(drop))
    }

    /// Fits, compares the values with the host's, and prints the cycles.
    fn check_fit<K: ScanModel>(recipe: &[u8], expected: &[u32]) -> Result<(), Error> {
        let mut memory = MEMORY;
        let mut scan = Scan::<K>::new(Recipe::parse(recipe)?, &mut memory)?;
        record(&mut scan)?;
        let start = DWT::cycle_count();
        let mut fit = scan.fit()?;
        while !fit.advance(1000).is_complete() {}
        let fitted = fit.finish()?;
        semihosting::println!("cycles: {}", DWT::cycle_count().wrapping_sub(start));
        assert!(
            fitted
                .values()
                .map(f32::to_bits)
                .eq(expected.iter().copied())
        );
        Ok(())
    }

    #[test]
    fn phong_has_the_bits_of_the_host(_counter: DWT) -> Result<(), Error> {
        check_fit::<Phong>(completed::PHONG, expected::PHONG)
    }

    #[test]
    fn cook_torrance_has_the_bits_of_the_host(_counter: DWT) -> Result<(), Error> {
        check_fit::<CookTorrance>(completed::COOK_TORRANCE, expected::COOK_TORRANCE)
    }

    #[test]
    fn neural_has_the_bits_of_the_host(_counter: DWT) -> Result<(), Error> {
        check_fit::<Neural>(completed::NEURAL, expected::NEURAL)
    }

    #[test]
    fn linear_has_the_bits_of_the_host(_counter: DWT) -> Result<(), Error> {
        check_fit::<Linear>(completed::LINEAR, expected::LINEAR)
    }

    /// A second scan begins with the readings that the first has saved.
    #[test]
    fn saved_readings_are_restored() -> Result<(), Error> {
        let mut slots = [[0xFF; Saved::slot_bytes(max_samples(&RECIPES))]; 2];
        let (mut first, mut second) = (MEMORY, MEMORY);
        let recipe = Recipe::parse(completed::NEURAL)?;
        let mut scan = Scan::<Neural>::new(recipe, &mut first)?;
        let (mut saved, _) = Saved::restore([&slots[0], &slots[1]], &mut scan);
        record(&mut scan)?;
        let mut buffer = slots[0];
        saved.write(&scan, &mut buffer, |slot, bytes| {
            slots[slot][..bytes.len()].copy_from_slice(bytes);
            Ok::<_, Error>(())
        })?;
        let mut scan = Scan::<Neural>::new(recipe, &mut second)?;
        let (_, restored) = Saved::restore([&slots[0], &slots[1]], &mut scan);
        assert!(restored == Ok(8) && scan.next_pending().is_none());
        Ok(())
    }

    #[test]
    fn damaged_recipes_are_refused() {
        let recipe = completed::LINEAR;
        let mut copy = [0; 8192];
        copy[..recipe.len()].copy_from_slice(recipe);
        for bit in (0..8 * recipe.len()).step_by(97) {
            copy[bit / 8] ^= 1 << (bit % 8);
            assert!(Recipe::parse(&copy[..recipe.len()]).is_err());
            copy[bit / 8] ^= 1 << (bit % 8);
        }
        assert!(Recipe::parse(&copy[..recipe.len()]).is_ok());
    }
}
