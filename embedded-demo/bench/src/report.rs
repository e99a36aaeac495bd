//! Runs a fit, and prints its cost and result.

use core::hint::black_box;

use glimpse_core::fit::ScanModel;
use glimpse_core::geometry::Directions;
use glimpse_core::model::linear::Basis;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;
use semihosting::{print, println};

use crate::machine::{counter, stack};
use crate::{BenchError, is_missing, measure, residual_bits};

/// Fits a model with all readings, or without the [missing](is_missing) ones. Memory and scan are statics, so the stack
/// contains only local variables.
///
/// # Errors
/// If the scan or the fit fails.
pub fn fit<'a, K: ScanModel, const WITH_MISSING: bool>(
    recipe: &'a [u8],
    basis: Option<&'a [u8]>,
    memory: &'a mut [f32],
    slot: &'a mut Option<Scan<'a, K>>,
) -> Result<(), BenchError> {
    stack::paint();
    let (scan, parsing) = begin(recipe, basis, memory, slot)?;
    advance::<K, WITH_MISSING>(scan, parsing)
}

/// Records the readings and fits. Not inlined, like [`begin`], so that their stack frames do not add up.
#[inline(never)]
fn advance<K: ScanModel, const WITH_MISSING: bool>(
    scan: &mut Scan<'_, K>,
    parsing: u32,
) -> Result<(), BenchError> {
    for (index, angles) in (0..).zip(scan.recipe().pattern()) {
        if WITH_MISSING && is_missing(index) {
            continue;
        }
        scan.record(index, measure(angles))
            .map_err(|_| BenchError)?;
    }
    let mut fit = scan.fit().map_err(|_| BenchError)?;
    let before = counter::now();
    while !fit.advance(u32::MAX).is_complete() {}
    let after = counter::now();
    let fitted = fit.finish().map_err(|_| BenchError)?;
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
    print_numbers("residual", residual_bits(&fitted.residual()).into_iter());
    print_numbers("parameters", fitted.values().map(f32::to_bits));
    Ok(())
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
) -> Result<(&'s mut Scan<'a, K>, u32), BenchError> {
    let before = counter::now();
    let recipe = Recipe::parse(black_box(recipe)).map_err(|_| BenchError)?;
    let after = counter::now();
    let mut scan = Scan::new(recipe, memory).map_err(|_| BenchError)?;
    if let Some(basis) = basis {
        let before = counter::now();
        let basis = Basis::parse(black_box(basis)).map_err(|_| BenchError)?;
        let after = counter::now();
        println!(
            "basis_parse_instructions={}",
            counter::between(before, after)
        );
        scan = scan.with_basis(basis).map_err(|_| BenchError)?;
    }
    *slot = Some(scan);
    let scan = slot.as_mut().ok_or(BenchError)?;
    Ok((scan, counter::between(before, after)))
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

/// Ends QEMU, with exit code 0 on success and 1 on an error.
pub fn end(outcome: Result<(), BenchError>) -> ! {
    semihosting::process::exit(match outcome {
        Ok(()) => 0,
        Err(BenchError) => 1,
    })
}

/// Defines the entry point and the panic handler: `firmware!(expression of type Result)`.
#[macro_export]
macro_rules! firmware {
    ($run:expr) => {
        #[cfg(target_arch = "arm")]
        use cortex_m_rt::entry;
        #[cfg(target_arch = "riscv32")]
        use riscv_rt::entry;

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

/// Defines a firmware that fits a model with a recipe: `fit!(model, recipe)`, or `fit!(model, recipe, true)` with
/// missing readings.
#[macro_export]
macro_rules! fit {
    ($model:ty, $recipe:expr) => {
        $crate::fit!($model, $recipe, false, None);
    };
    ($model:ty, $recipe:expr, $with_missing:literal) => {
        $crate::fit!($model, $recipe, $with_missing, None);
    };
    ($model:ty, $recipe:expr, $with_missing:literal, $basis:expr) => {
        $crate::firmware!({
            use glimpse_core::recipe::memory_words;
            use glimpse_core::scan::Scan;
            use $crate::machine::unique_static;

            static mut MEMORY: [f32; memory_words(&[$recipe])] = [0.0; memory_words(&[$recipe])];
            static mut SCAN: Option<Scan<'static, $model>> = None;
            // SAFETY: the entry point runs once, and these references are the only ones.
            unsafe {
                $crate::report::fit::<_, $with_missing>(
                    $recipe,
                    $basis,
                    &mut unique_static(&raw mut MEMORY)[..],
                    unique_static(&raw mut SCAN),
                )
            }
        });
    };
}
