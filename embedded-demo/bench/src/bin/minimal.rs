//! A minimal firmware: it parses a recipe, scans, fits Neural and evaluates the BRDF. `core/docs/costs.md` has its
//! flash size by profile.

#![no_std]
#![no_main]

use core::hint::black_box;
use core::panic::PanicInfo;

use glimpse_bench::machine::entry;
use glimpse_bench::recipes::NEURAL;
use glimpse_core::geometry::Directions;
use glimpse_core::gonio::Reading;
use glimpse_core::model::Neural;
use glimpse_core::recipe::{Recipe, memory_words};
use glimpse_core::scan::Scan;

const WORDS: usize = memory_words(&[NEURAL]);

#[entry]
fn main() -> ! {
    static mut MEMORY: [f32; WORDS] = [0.0; WORDS]; // `entry` makes it a `&mut`
    black_box(scan(MEMORY));
    loop {
        core::hint::spin_loop();
    }
}

fn scan(memory: &mut [f32]) -> Option<[f32; 3]> {
    let recipe = Recipe::parse(black_box(NEURAL)).ok()?;
    let mut scan = Scan::<Neural>::new(recipe, memory).ok()?;
    while let Some((index, directions)) = scan.next_pending() {
        black_box(directions);
        scan.record(index, Reading::new(black_box([0.1; 3]))).ok()?;
    }
    let mut fit = scan.fit().ok()?;
    while !fit.advance(8).is_complete() {}
    fit.finish().ok()?.brdf(&black_box(Directions {
        incoming: [0.0, 0.0, 1.0],
        outgoing: [0.0, 0.0, 1.0],
    }))
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
