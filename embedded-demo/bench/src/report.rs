//! Runs a fit, and prints its cost and result.

use core::hint::black_box;

use glimpse_core::fit::ScanModel;
use glimpse_core::geometry::Directions;
use glimpse_core::model::linear::Basis;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;
use semihosting::{print, println};

use crate::machine::counter;
use crate::{is_missing, measure, stack};

/// Fits a model with all readings, or without the [missing](is_missing) ones. Memory and scan are statics, so the stack
/// contains only local variables. Returns None if the scan or the fit fails.
pub fn fit<'a, K: ScanModel, const WITH_MISSING: bool>(
    recipe: &'a [u8],
    basis: Option<&'a [u8]>,
    memory: &'a mut [f32],
    slot: &'a mut Option<Scan<'a, K>>,
) -> Option<()> {
    stack::paint();
    let (scan, parsing) = begin(recipe, basis, memory, slot)?;
    advance::<K, WITH_MISSING>(scan, parsing)
}

/// Records the readings and fits. Not inlined, like [`begin`], so that their stack frames do not add up.
#[inline(never)]
fn advance<K: ScanModel, const WITH_MISSING: bool>(
    scan: &mut Scan<'_, K>,
    parsing: u32,
) -> Option<()> {
    for (index, angles) in (0..).zip(scan.recipe().pattern()) {
        if WITH_MISSING && is_missing(index) {
            continue;
        }
        scan.record(index, measure(angles)).ok()?;
    }
    let mut fit = scan.fit().ok()?;
    let before = counter::now();
    while !fit.advance(u32::MAX).is_complete() {}
    let after = counter::now();
    let fitted = fit.finish().ok()?;
    let stack = stack::peak_bytes();
    let before_brdf = counter::now();
    black_box(fitted.brdf(black_box(&OBLIQUE)));
    let after_brdf = counter::now();
    println!("parse_instructions={parsing}");
    println!(
        "brdf_instructions={}",
        counter::between(before_brdf, after_brdf)
    );
    print_costs(counter::between(before, after), stack);
    let residual = fitted.residual();
    let residual = [residual.mean, residual.worst].map(f32::to_bits);
    print_numbers("residual", residual.into_iter());
    print_numbers("parameters", fitted.values().map(f32::to_bits));
    Some(())
}

/// Directions of the BRDF evaluation.
const OBLIQUE: Directions<f32> = Directions {
    incoming: [0.6, 0.0, 0.8],
    outgoing: [0.0, 0.6, 0.8],
};

/// Parses the recipe and begins a scan. Also returns the instructions of parsing. Not inlined: its stack frame is free
/// again before the fit.
#[inline(never)]
fn begin<'a, 's, K: ScanModel>(
    recipe: &'a [u8],
    basis: Option<&'a [u8]>,
    memory: &'a mut [f32],
    slot: &'s mut Option<Scan<'a, K>>,
) -> Option<(&'s mut Scan<'a, K>, u32)> {
    let before = counter::now();
    let recipe = Recipe::parse(black_box(recipe)).ok()?;
    let after = counter::now();
    let mut scan = Scan::new(recipe, memory).ok()?;
    if let Some(basis) = basis {
        let before = counter::now();
        let basis = Basis::parse(black_box(basis)).ok()?;
        let after = counter::now();
        println!(
            "basis_parse_instructions={}",
            counter::between(before, after)
        );
        scan = scan.with_basis(basis).ok()?;
    }
    Some((slot.insert(scan), counter::between(before, after)))
}

/// Prints the same lines as a fit, without a fit.
pub fn baseline() {
    stack::paint();
    let before = counter::now();
    let after = counter::now();
    print_costs(counter::between(before, after), stack::peak_bytes());
    print_numbers("residual", [0; 2].into_iter());
    print_numbers("parameters", black_box(&[0_u32; 4]).iter().copied());
}

#[inline(never)] // formatting must not add to the fit's stack
fn print_costs(instructions: u32, stack: usize) {
    println!("fit_instructions={instructions}");
    println!("stack_bytes={stack}");
}

/// Prints numbers as hexadecimal digits.
#[inline(never)]
fn print_numbers(name: &str, bits: impl Iterator<Item = u32>) {
    print!("{name}=");
    for bits in bits {
        print!("{bits:08x} ");
    }
    println!("");
}

/// Ends QEMU, with exit code 0 on success and 1 on a failure.
pub fn end(outcome: Option<()>) -> ! {
    semihosting::process::exit(i32::from(outcome.is_none()))
}

/// Defines the entry point and the panic handler: `firmware!(run)`. `run` is an expression of type
/// `Option<()>`, None on a failure.
#[macro_export]
macro_rules! firmware {
    ($run:expr) => {
        use $crate::machine::entry;

        #[entry]
        fn main() -> ! {
            $crate::machine::counter::start();
            $crate::report::end($run)
        }

        #[panic_handler]
        fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
            semihosting::process::exit(2)
        }
    };
}

/// Defines a firmware that fits a model with a recipe: `fit!(model, recipe)`, or `fit!(model, recipe, true, None)` with
/// missing readings, or `fit!(model, recipe, false, Some(basis))`.
#[macro_export]
macro_rules! fit {
    ($model:ty, $recipe:expr) => {
        $crate::fit!($model, $recipe, false, None);
    };
    ($model:ty, $recipe:expr, $with_missing:literal, $basis:expr) => {
        $crate::firmware!({
            use glimpse_core::fit::*;
            use glimpse_core::model::*;
            use glimpse_core::recipe::memory_words;
            use glimpse_core::scan::Scan;
            use $crate::recipes::*;

            static mut MEMORY: [f32; memory_words(&[$recipe])] = [0.0; memory_words(&[$recipe])];
            static mut SCAN: Option<Scan<'static, $model>> = None;
            // SAFETY: the entry point runs once, and these references are the only ones.
            unsafe {
                $crate::report::fit::<_, $with_missing>(
                    $recipe,
                    $basis,
                    &mut *(&raw mut MEMORY),
                    &mut *(&raw mut SCAN),
                )
            }
        });
    };
}
