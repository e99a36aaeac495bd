//! Runs a fit between two readings of the counter, and prints what came of it.

use core::hint::black_box;

use glimpse_core::fit::Fitter;
use glimpse_core::geometry::Directions;
use glimpse_core::model::linear::Basis;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;
use semihosting::{print, println};

use crate::machine::{counter, stack};
use crate::{Refused, is_lost, measure, residual_bits};

/// Fits a model, with all readings or with those that are not [lost](is_lost). Memory and scan lie in
/// statics: the stack is for what is going on.
///
/// # Errors
/// If the recipe is refused.
pub fn fit<'a, K: Fitter, const LOSES: bool>(
    recipe: &'a [u8],
    basis: Option<&'a [u8]>,
    memory: &'a mut [f32],
    place: &'a mut Option<Scan<'a, K>>,
) -> Result<(), Refused> {
    stack::paint();
    let (scan, parsing) = begin(recipe, basis, memory, place)?;
    advance::<K, LOSES>(scan, parsing)
}

/// Out of line, as is [`begin`]: neither's frame is there while the other one's is.
#[inline(never)]
fn advance<K: Fitter, const LOSES: bool>(
    scan: &mut Scan<'_, K>,
    parsing: u32,
) -> Result<(), Refused> {
    for (index, angles) in (0..).zip(scan.recipe().pattern()) {
        if LOSES && is_lost(index) {
            continue;
        }
        scan.record(index, measure(angles)).map_err(|_| Refused)?;
    }
    let mut fit = scan.fit().map_err(|_| Refused)?;
    let before = counter::now();
    while !fit.advance(u32::MAX).is_complete() {}
    let after = counter::now();
    let fitted = fit.finish().map_err(|_| Refused)?;
    let stack = stack::bytes();
    let asked = counter::now();
    black_box(fitted.brdf(black_box(&SLANTED)));
    let answered = counter::now();
    println!("parse_instructions={parsing}");
    println!("brdf_instructions={}", counter::between(asked, answered));
    print_costs(counter::between(before, after), stack);
    print_numbers("residual", residual_bits(&fitted.residual()).into_iter());
    print_numbers("parameters", fitted.values().map(f32::to_bits));
    Ok(())
}

/// Directions whose BRDF is asked for.
const SLANTED: Directions<f32> = Directions {
    incoming: [0.6, 0.0, 0.8],
    outgoing: [0.0, 0.6, 0.8],
};

/// Parses the recipe and begins a scan; returns what parsing took. Out of line: what it takes of the stack is given
/// back before anything is measured.
#[inline(never)]
fn begin<'a, 's, K: Fitter>(
    recipe: &'a [u8],
    basis: Option<&'a [u8]>,
    memory: &'a mut [f32],
    place: &'s mut Option<Scan<'a, K>>,
) -> Result<(&'s mut Scan<'a, K>, u32), Refused> {
    let before = counter::now();
    let recipe = Recipe::parse(black_box(recipe)).map_err(|_| Refused)?;
    let after = counter::now();
    let mut scan = Scan::new(recipe, memory).map_err(|_| Refused)?;
    if let Some(basis) = basis {
        let before = counter::now();
        let basis = Basis::parse(black_box(basis)).map_err(|_| Refused)?;
        let after = counter::now();
        println!(
            "basis_parse_instructions={}",
            counter::between(before, after)
        );
        scan = scan.with_basis(basis).map_err(|_| Refused)?;
    }
    *place = Some(scan);
    let scan = place.as_mut().ok_or(Refused)?;
    Ok((scan, counter::between(before, after)))
}

/// Prints as the others do.
pub fn nothing() {
    stack::paint();
    let before = counter::now();
    let after = counter::now();
    print_costs(counter::between(before, after), stack::bytes());
    print_numbers("residual", [0; 2].into_iter());
    print_numbers("parameters", black_box(&[0_u32; 4]).iter().copied());
}

/// Prints what another fit took, between two readings of the counter, and its parameters.
pub fn print_result(before: u32, after: u32, parameters: [u32; 7]) {
    let stack = stack::bytes();
    print_costs(counter::between(before, after), stack);
    print_numbers("parameters", parameters.into_iter());
}

#[inline(never)] // what formatting takes of the stack is not the fit's
fn print_costs(instructions: u32, stack: usize) {
    println!("fit_instructions={instructions}");
    println!("stack_bytes={stack}");
}

/// Numbers as the hexadecimal digits of their bits.
#[inline(never)]
fn print_numbers(name: &str, bits: impl Iterator<Item = u32>) {
    print!("{name}=");
    for bits in bits {
        print!("{bits:08x} ");
    }
    println!("");
}

/// Ends QEMU: well, or with a code that says otherwise.
pub fn end(outcome: Result<(), Refused>) -> ! {
    semihosting::process::exit(match outcome {
        Ok(()) => 0,
        Err(Refused) => 1,
    })
}

/// The entry point: `firmware!(expression of Result)`, with the panic handler.
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

/// A firmware that fits a model with a recipe: `fit!(model, recipe)`, or, where readings are lost,
/// `fit!(model, recipe, true)`.
#[macro_export]
macro_rules! fit {
    ($model:ty, $recipe:expr) => {
        $crate::fit!($model, $recipe, false, None);
    };
    ($model:ty, $recipe:expr, $loses:literal) => {
        $crate::fit!($model, $recipe, $loses, None);
    };
    ($model:ty, $recipe:expr, $loses:literal, $basis:expr) => {
        $crate::firmware!({
            use glimpse_core::recipe::memory_words;
            use glimpse_core::scan::Scan;
            use $crate::machine::only;

            static mut MEMORY: [f32; memory_words(&[$recipe])] = [0.0; memory_words(&[$recipe])];
            static mut SCAN: Option<Scan<'static, $model>> = None;
            // SAFETY: the entry point runs once, and nothing else knows of them.
            unsafe {
                $crate::report::fit::<_, $loses>(
                    $recipe,
                    $basis,
                    &mut only(&raw mut MEMORY)[..],
                    only(&raw mut SCAN),
                )
            }
        });
    };
}
