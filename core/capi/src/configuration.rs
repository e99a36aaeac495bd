//! The model, selected at build time, and the types behind the handles.

use glimpse_core::driver::Driver;
use glimpse_core::scan::Scan;

#[cfg(any(
    all(feature = "only-phong", feature = "only-cook-torrance"),
    all(feature = "only-phong", feature = "only-neural"),
    all(feature = "only-phong", feature = "only-linear"),
    all(feature = "only-cook-torrance", feature = "only-neural"),
    all(feature = "only-cook-torrance", feature = "only-linear"),
    all(feature = "only-neural", feature = "only-linear"),
))]
compile_error!(
    "the features `only-...` are mutually exclusive: select one of them, or none for all models"
);

#[cfg(feature = "only-phong")]
pub(crate) type Fitter = glimpse_core::model::Phong;
#[cfg(feature = "only-cook-torrance")]
pub(crate) type Fitter = glimpse_core::model::CookTorrance;
#[cfg(feature = "only-neural")]
pub(crate) type Fitter = glimpse_core::model::Neural;
#[cfg(feature = "only-linear")]
pub(crate) type Fitter = glimpse_core::fit::Linear;
#[cfg(not(any(
    feature = "only-phong",
    feature = "only-cook-torrance",
    feature = "only-neural",
    feature = "only-linear"
)))]
pub(crate) type Fitter = glimpse_core::fit::AnyModel;

/// The scan behind a handle. It borrows the caller's memory and recipe, whose lifetimes the caller guarantees.
pub(crate) type CScan = Scan<'static, Fitter>;

/// The driver behind a handle, and the length of its memory. The driver is the first field, so a pointer to this struct
/// is also a pointer to the driver.
#[repr(C)]
pub(crate) struct CDriver {
    pub(crate) driver: Driver<'static, Fitter>,
    /// Words (of 4 bytes) behind the handle.
    pub(crate) words: usize,
}

/// `GLIMPSE_ALIGNMENT`.
pub(crate) const ALIGNMENT: usize = 8;

/// `GLIMPSE_SCAN_BYTES(words)`; None if it overflows.
pub(crate) const fn scan_bytes(words: usize) -> Option<usize> {
    const HANDLE_BYTES: usize = 64 * size_of::<usize>() + 64;
    match words.checked_mul(size_of::<f32>()) {
        Some(bytes) => bytes.checked_add(HANDLE_BYTES),
        None => None,
    }
}

/// `GLIMPSE_DRIVER_BYTES(words)`; None if it overflows.
pub(crate) const fn driver_bytes(words: usize) -> Option<usize> {
    match scan_bytes(words) {
        Some(bytes) => bytes.checked_add(640),
        None => None,
    }
}

const _: () = assert!(
    matches!(scan_bytes(0), Some(bytes) if size_of::<CScan>() <= bytes),
    "GLIMPSE_SCAN_BYTES is too small: raise it in cbindgen.toml and configuration.rs"
);
const _: () = assert!(
    matches!(driver_bytes(0), Some(bytes) if size_of::<CDriver>() <= bytes),
    "GLIMPSE_DRIVER_BYTES is too small: raise it in cbindgen.toml and configuration.rs"
);
const _: () = assert!(align_of::<CDriver>() <= ALIGNMENT && align_of::<CScan>() <= ALIGNMENT);
