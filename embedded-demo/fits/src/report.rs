//! Runs a fit between two readings of the counter, and prints what came of it.

use core::hint::black_box;

use glimpse_core::fit::Workspace;
use glimpse_core::model::{Model, ParameterSet};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{LinearScan, Scan};
use semihosting::{print, println};

use crate::machine::{counter, stack};
use crate::{LINEAR_MEMORY, Refused, SAMPLES, record_all, residual_bits};

/// Fits a model by descent. The scan lies in `place`, a static: the stack is for what is going on.
///
/// # Errors
/// If the recipe is refused.
pub fn descend<'a, M: Model>(
    recipe: &'a [u8],
    workspace: &'a mut Workspace<M>,
    place: &mut Option<Scan<'a, M, SAMPLES>>,
) -> Result<(), Refused> {
    stack::paint();
    let scan = begin(recipe, workspace, place)?;
    record_all!(scan);
    let before = counter::now();
    while !scan.advance_fit(usize::MAX).is_complete() {}
    let after = counter::now();
    let residual = scan.residual();
    let stack = stack::bytes();
    print_costs(counter::between(before, after), stack);
    print_numbers("residual", residual_bits(&residual).into_iter());
    print_numbers(
        "parameters",
        scan.parameters().iter().map(|value| value.to_bits()),
    );
    Ok(())
}

/// Out of line: what it takes of the stack is given back before anything is measured.
#[inline(never)]
fn begin<'a, 's, M: Model>(
    recipe: &'a [u8],
    workspace: &'a mut Workspace<M>,
    place: &'s mut Option<Scan<'a, M, SAMPLES>>,
) -> Result<&'s mut Scan<'a, M, SAMPLES>, Refused> {
    let recipe = Recipe::parse(black_box(recipe)).map_err(|_| Refused)?;
    *place = Scan::new(recipe, workspace).ok();
    place.as_mut().ok_or(Refused)
}

/// Solves for Linear's coefficients.
///
/// # Errors
/// If the recipe is refused.
pub fn solve<'a>(
    recipe: &'a [u8],
    memory: &'a mut [f32; LINEAR_MEMORY],
    place: &mut Option<LinearScan<'a, SAMPLES>>,
) -> Result<(), Refused> {
    stack::paint();
    let before = counter::now();
    let scan = begin_linear(recipe, memory, place)?;
    let factorized = counter::now();
    record_all!(scan);
    let recorded = counter::now();
    while !scan.advance_fit(usize::MAX).is_complete() {}
    let after = counter::now();
    let residual = scan.residual();
    let stack = stack::bytes();
    print_costs(counter::between(recorded, after), stack);
    println!(
        "begin_instructions={}",
        counter::between(before, factorized)
    );
    print_numbers("residual", residual_bits(&residual).into_iter());
    print_numbers(
        "parameters",
        scan.coefficients().iter().map(|value| value.to_bits()),
    );
    Ok(())
}

#[inline(never)]
fn begin_linear<'a, 's>(
    recipe: &'a [u8],
    memory: &'a mut [f32; LINEAR_MEMORY],
    place: &'s mut Option<LinearScan<'a, SAMPLES>>,
) -> Result<&'s mut LinearScan<'a, SAMPLES>, Refused> {
    let recipe = Recipe::parse(black_box(recipe)).map_err(|_| Refused)?;
    *place = LinearScan::new(recipe, memory).ok();
    place.as_mut().ok_or(Refused)
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
