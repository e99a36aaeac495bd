//! Statuses of calls, with their numbers and texts.

use core::ffi::{CStr, c_char};

use glimpse_core::error_code::ErrorCode;
use glimpse_core::link::Failure;
use glimpse_core::model::linear::BasisError;
use glimpse_core::recipe::RecipeError;
use glimpse_core::scan::{FinishError, FitError, ReadingError, ScanError, SkipError};

/// The status of a call: 0 on success. glimpse_status_text() returns its text.
///
/// After a status other than GLIMPSE_STATUS_OK nothing has changed and no result is written, unless the
/// function states otherwise. The meaning of a number never changes.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum glimpse_status {
    /// Success.
    Ok = 0,
    /// A required pointer is null.
    Null = 1,
    /// A pointer does not have the alignment of its type, or the memory is not aligned to GLIMPSE_ALIGNMENT.
    Misaligned = 2,
    /// The memory is too small for the recipe: see glimpse_scan_bytes() and glimpse_driver_bytes().
    MemoryTooSmall = 3,
    /// A length exceeds the address space.
    Length = 4,
    /// The buffer is too small for the result; the count is the required capacity.
    BufferTooSmall = 5,
    /// An argument is out of range.
    Argument = 6,
    /// An error of glimpse-core that this library does not know.
    Unknown = 7,

    /// No sample is pending: the loop over samples ends.
    NonePending = 16,
    /// This sample has no reading.
    NotRead = 17,
    /// A reading is missing; glimpse_scan_next() returns its sample.
    Incomplete = 18,
    /// No fit is under way; glimpse_fit_begin() begins one, and a reading ends it.
    NoFit = 19,
    /// The fit is not complete: call glimpse_fit_advance() until done equals total.
    Unfinished = 20,
    /// No fit has been finished since the last reading: call glimpse_fit_finish().
    NotFitted = 21,
    /// The driver has no scan, because its recipe is unusable.
    NoScan = 22,

    /// The bytes are not a recipe.
    RecipeMagic = 32,
    /// The recipe has an unknown format version.
    RecipeVersion = 33,
    /// The recipe was truncated or padded.
    RecipeLength = 34,
    /// The recipe's bytes were altered.
    RecipeChecksum = 35,
    /// The recipe's body does not follow the format.
    RecipeMalformed = 36,
    /// A field of the recipe has an impossible count.
    RecipeCount = 37,
    /// A field of the recipe holds a NaN or an infinity.
    RecipeNonFinite = 38,
    /// A direction of the recipe's pattern is below the horizon.
    RecipeBelowHorizon = 39,
    /// A descent cannot fit the recipe's model.
    RecipeModel = 40,
    /// A field of the recipe holds a number that is not positive.
    RecipeNotPositive = 41,
    /// A field of the recipe holds a negative number.
    RecipeNegative = 42,
    /// A field of the recipe holds a number out of range.
    RecipeRange = 43,
    /// The limits in the recipe are invalid.
    RecipeLimits = 44,
    /// The recipe has a required section that this library does not know.
    RecipeUnknown = 45,
    /// The recipe's sections are invalid or out of order.
    RecipeSections = 46,

    /// The recipe's model is not the one that this library was built for.
    Model = 48,
    /// A driver's memory is too small for its recipe.
    Memory = 50,
    /// The basis is not the one that the recipe names.
    Basis = 51,
    /// The bytes are not a compact basis.
    BasisMagic = 52,
    /// The compact basis has an unknown format version.
    BasisVersion = 53,
    /// The compact basis was truncated or padded.
    BasisLength = 54,
    /// The compact basis's bytes were altered.
    BasisChecksum = 55,
    /// The compact basis has an impossible count or scale.
    BasisMalformed = 56,

    /// A channel of the reading is not a finite number.
    ReadingNonFinite = 64,
    /// A channel of the reading is below -1 sr^-1, which noise cannot explain.
    ReadingNegative = 65,
    /// The recipe's pattern has no sample with this index.
    ReadingIndex = 66,
    /// A sample was skipped, but the recipe needs every reading.
    ReadingRequired = 67,

    /// The readings are too large for a BRDF: pass values in sr^-1, not counts.
    TooLarge = 80,
    /// The fit diverged.
    Diverged = 81,
    /// A direction is below the horizon, not finite or not of unit length.
    Directions = 82,
    /// Linear has no BRDF without a basis: see glimpse_scan_set_basis().
    NoBasis = 83,
    /// Implausible: the readings are not above 0.
    Dark = 84,
    /// Implausible: all readings are equal.
    Repeated = 85,
    /// Implausible: the red channel's readings are near 0, but another channel's are not.
    DeadRed = 86,
    /// Implausible: the green channel's readings are near 0, but another channel's are not.
    DeadGreen = 87,
    /// Implausible: the blue channel's readings are near 0, but another channel's are not.
    DeadBlue = 88,
    /// Implausible: the material reflects several times the light it receives.
    Albedo = 89,
    /// Implausible: the fit explains its readings far worse than expected.
    Residual = 90,
    /// Implausible for a reason that this version does not know.
    ImplausibleOther = 91,

    /// The device's own arms or sensor failed.
    Machine = 96,
    /// The host uses another version of the protocol.
    Protocol = 97,
    /// The host does not reply.
    NoReply = 98,
    /// The host refused: no scan has begun.
    RefusedNoScan = 99,
    /// The host refused: it cannot reach these directions.
    RefusedDirections = 100,
    /// The host refused: the model has a different number of values.
    RefusedValues = 101,
    /// The host refused: it does not support this model.
    RefusedModel = 102,
    /// The host refused: it has not sent this reading.
    RefusedSaved = 103,
    /// The host refused: it no longer sends the recipe that it offered.
    RefusedRecipe = 104,
    /// Samples of the recipe are out of reach of the arms.
    OutOfReach = 105,
    /// The host refused: it does not support this request.
    RefusedRequest = 106,
    /// The host refused for a reason that the device does not know.
    RefusedOther = 107,
}

use glimpse_status as Status;

/// The statuses that `glimpse-core` has no error code for, with their texts.
const OWN_TEXTS: &[(Status, &CStr)] = &[
    (Status::Ok, c"success"),
    (
        Status::Null,
        c"a required pointer is null: check the status of the call that it came from",
    ),
    (
        Status::Misaligned,
        c"a pointer does not have the alignment of its type: declare memory with GLIMPSE_MEMORY",
    ),
    (
        Status::MemoryTooSmall,
        c"the memory is too small for the recipe: glimpse_scan_bytes and glimpse_driver_bytes return the required size",
    ),
    (Status::Length, c"a length exceeds the address space"),
    (Status::Argument, c"an argument is out of range: see the function's documentation in glimpse.h"),
    (
        Status::Unknown,
        c"an error that this library does not know: update the library",
    ),
    (Status::NonePending, c"no sample is pending"),
    (Status::NotRead, c"this sample has no reading"),
    (
        Status::NoFit,
        c"no fit is under way: glimpse_fit_begin begins one, and a reading ends it",
    ),
    (
        Status::NotFitted,
        c"no fit has been finished since the last reading: call glimpse_fit_finish",
    ),
    (
        Status::NoScan,
        c"the driver has no scan, because its recipe is unusable",
    ),
    (
        Status::Directions,
        c"a direction is below the horizon, not finite or not of unit length",
    ),
    (
        Status::NoBasis,
        c"Linear has no BRDF without a basis: call glimpse_scan_set_basis, or compute it on a host from the values",
    ),
];

/// Defines the texts of these statuses, and converts the error codes of `glimpse-core` with these names to them. The
/// numbers of an error code and its status are equal.
macro_rules! core_codes {
    ($($name:ident)+) => {
        /// The statuses of `glimpse-core`'s error codes, with their texts.
        const CORE_TEXTS: &[(Status, &CStr)] = &[$((Status::$name, {
            const TEXT: &str = ErrorCode::$name.text();
            const BYTES: [u8; TEXT.len().wrapping_add(1)] = terminated(TEXT);
            match CStr::from_bytes_with_nul(&BYTES) {
                Ok(text) => text,
                Err(_) => c"",
            }
        }),)+];

        $(const _: () = assert!(Status::$name as i32 == ErrorCode::$name.code() as i32);)+

        impl From<ErrorCode> for Status {
            fn from(code: ErrorCode) -> Self {
                match code {
                    $(ErrorCode::$name => Self::$name,)+
                    _ => Self::Unknown,
                }
            }
        }
    };
}

core_codes! {
    BufferTooSmall
    Incomplete Unfinished
    RecipeMagic RecipeVersion RecipeLength RecipeChecksum RecipeMalformed RecipeCount RecipeNonFinite
    RecipeBelowHorizon RecipeModel RecipeNotPositive RecipeNegative RecipeRange RecipeLimits RecipeUnknown
    RecipeSections
    Model Memory Basis BasisMagic BasisVersion BasisLength BasisChecksum BasisMalformed
    ReadingNonFinite ReadingNegative ReadingIndex ReadingRequired
    TooLarge Diverged Dark Repeated DeadRed DeadGreen DeadBlue Albedo Residual ImplausibleOther
    Machine Protocol NoReply
    RefusedNoScan RefusedDirections RefusedValues RefusedModel RefusedSaved RefusedRecipe OutOfReach
    RefusedRequest RefusedOther
}

/// Returns a zero-terminated copy of a text of `N - 1` bytes.
const fn terminated<const N: usize>(text: &str) -> [u8; N] {
    let mut bytes = [0; N];
    let mut to = bytes.as_mut_slice();
    let mut from = text.as_bytes();
    while let ([first, rest @ ..], [byte, others @ ..]) = (to, from) {
        *first = *byte;
        (to, from) = (rest, others);
    }
    bytes
}

/// Returns every status with its text.
pub(crate) fn texts() -> impl Iterator<Item = (Status, &'static CStr)> {
    OWN_TEXTS.iter().chain(CORE_TEXTS).copied()
}

/// Returns the text of a status: an English sentence, zero-terminated, constant and never null. A number
/// that is not a status has a text, too.
#[unsafe(no_mangle)]
pub extern "C" fn glimpse_status_text(status: i32) -> *const c_char {
    let found = texts().find(|(known, _)| *known as i32 == status);
    found
        .map_or(c"this number is not a status", |(_, text)| text)
        .as_ptr()
}

/// Returns the version of this library, such as "0.3.0": zero-terminated, constant and never null. It
/// should equal the header's GLIMPSE_VERSION.
#[unsafe(no_mangle)]
pub extern "C" fn glimpse_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0")
        .as_ptr()
        .cast::<c_char>()
}

/// Converts these errors by their error codes.
macro_rules! from_code {
    ($($error:ty)+) => {
        $(impl From<$error> for Status {
            fn from(error: $error) -> Self {
                error.code().into()
            }
        })+
    };
}

from_code! { RecipeError BasisError ScanError ReadingError SkipError FitError FinishError Failure }
