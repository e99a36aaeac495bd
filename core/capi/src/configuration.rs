//! What is chosen when the library is built: the model, and how much there is room for.
//!
//! `GLIMPSE_SAMPLES` and `GLIMPSE_COMPONENTS` are read from the environment of `cargo build`; C
//! defines macros of the same names. The formulas here stand in the header too (cbindgen.toml); a
//! test compiles both and compares them.

#![allow(clippy::arithmetic_side_effects)] // all of it while compiling

use glimpse_core::fit::{MAX_ROWS, MAX_UNITS, linear_words};
use glimpse_core::scan::{Memory, Scan};

/// The largest n.
pub(crate) const SAMPLES: usize = number(option_env!("GLIMPSE_SAMPLES"), 32);
/// The largest m of Linear, at so many samples.
pub(crate) const COMPONENTS: usize = number(option_env!("GLIMPSE_COMPONENTS"), 60);
#[cfg(not(any(
    feature = "only-phong",
    feature = "only-cook-torrance",
    feature = "only-neural"
)))]
const WORDS: usize = linear_words(SAMPLES, COMPONENTS);

#[cfg(any(
    all(feature = "only-phong", feature = "only-cook-torrance"),
    all(feature = "only-phong", feature = "only-neural"),
    all(feature = "only-phong", feature = "only-linear"),
    all(feature = "only-cook-torrance", feature = "only-neural"),
    all(feature = "only-cook-torrance", feature = "only-linear"),
    all(feature = "only-neural", feature = "only-linear"),
))]
compile_error!("one model alone, or all of them: choose one feature `only-...`, or none");

#[cfg(feature = "only-phong")]
pub(crate) type Fitter = glimpse_core::model::Phong;
#[cfg(feature = "only-cook-torrance")]
pub(crate) type Fitter = glimpse_core::model::CookTorrance;
#[cfg(feature = "only-neural")]
pub(crate) type Fitter = glimpse_core::model::Neural;
#[cfg(feature = "only-linear")]
pub(crate) type Fitter = glimpse_core::fit::Linear<WORDS>;
#[cfg(not(any(
    feature = "only-phong",
    feature = "only-cook-torrance",
    feature = "only-neural",
    feature = "only-linear"
)))]
pub(crate) type Fitter = glimpse_core::fit::AnyModel<WORDS>;

/// The scan that C's handles stand for. What it borrows is C's, and lives as long as C promised.
pub(crate) type CScan = Scan<'static, Fitter>;
pub(crate) type CMemory = Memory<Fitter, SAMPLES>;
pub(crate) type CDriver = glimpse_core::driver::Driver<'static, Fitter>;

/// `GLIMPSE_ALIGNMENT`.
pub(crate) const ALIGNMENT: usize = 8;

/// Parameters and gradients of the models that descend, and what readings are completed in for each of
/// them: `GLIMPSE_MODEL_BYTES`.
const MODEL_BYTES: usize = match () {
    () if cfg!(feature = "only-phong") => 2 * 4 * 7 + COMPLETION_BYTES,
    () if cfg!(feature = "only-cook-torrance") => 2 * 4 * 8 + COMPLETION_BYTES,
    () if cfg!(feature = "only-neural") => 2 * 4 * 675,
    () if cfg!(feature = "only-linear") => 0,
    () => 2 * 4 * (7 + 8 + 675) + 2 * COMPLETION_BYTES,
};
const COMPLETION_BYTES: usize = 4 * (4 * MAX_ROWS + MAX_UNITS);
/// Whether Linear is there, whose numbers come on top.
const HAS_LINEAR: bool = !cfg!(any(
    feature = "only-phong",
    feature = "only-cook-torrance",
    feature = "only-neural"
));

/// `GLIMPSE_SCAN_BYTES`, for so many samples and components.
pub(crate) const fn scan_bytes(samples: usize, components: usize) -> usize {
    let linear = if HAS_LINEAR {
        4 * linear_words(samples, components)
    } else {
        0
    };
    38 * samples + MODEL_BYTES + linear + 48 * size_of::<usize>() + 64
}

/// `GLIMPSE_DRIVER_BYTES`, for so many samples and components.
pub(crate) const fn driver_bytes(samples: usize, components: usize) -> usize {
    scan_bytes(samples, components) + 1024
}

const _: () = assert!(
    SAMPLES >= 1 && SAMPLES <= glimpse_core::recipe::MAX_SAMPLES,
    "GLIMPSE_SAMPLES is 1 to 4096"
);
const _: () = assert!(
    COMPONENTS <= glimpse_core::recipe::MAX_COMPONENTS,
    "GLIMPSE_COMPONENTS is 0 (no Linear) to 1024"
);

#[allow(clippy::panic)] // while compiling
const fn number(text: Option<&str>, default: usize) -> usize {
    match text {
        None => default,
        Some(text) => match usize::from_str_radix(text, 10) {
            Ok(number) => number,
            Err(_) => panic!("GLIMPSE_SAMPLES and GLIMPSE_COMPONENTS are plain numbers"),
        },
    }
}
