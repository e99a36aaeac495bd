//! Statuses of calls, with their numbers and texts.

use core::ffi::c_char;

use glimpse_core::error::{Error, ErrorCode};

/// The status of a call: 0 on success. glimpse_status_text() returns its text.
///
/// A negative status names an invalid argument: the program has a defect. A pointer argument is invalid if
/// it is null although it is required, if it does not have the alignment of its type, or if its array
/// exceeds the address space.
///
/// After a status other than GLIMPSE_STATUS_OK nothing has changed and no result is written, unless the
/// function states otherwise. The meaning of a number never changes.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum glimpse_status {
    /// The argument `scan` is an invalid pointer.
    ArgumentScan = -1,
    /// The argument `driver` is an invalid pointer.
    ArgumentDriver = -2,
    /// The argument `scan` or `driver` is stale: in this memory nothing was begun, it was ended or moved, or
    /// the other kind was begun.
    Stale = -3,
    /// The argument `scan` is a driver's scan, which changes only with functions of the driver.
    ReadOnly = -4,
    /// The argument `memory` is an invalid pointer, or not aligned to GLIMPSE_ALIGNMENT.
    ArgumentMemory = -5,
    /// The argument `recipe` is an invalid pointer, or it was rejected although it is usable.
    ArgumentRecipe = -6,
    /// The argument `basis` is an invalid pointer.
    ArgumentBasis = -7,
    /// The argument `config` is an invalid pointer.
    ArgumentConfig = -8,
    /// The host in the argument `config` is not one of glimpse_host.
    ArgumentHost = -9,
    /// The target loss in the argument `config` is negative or NAN.
    ArgumentTargetLoss = -10,
    /// The argument `machine`, or the machine in `config`, is an invalid pointer or has invalid limits.
    ArgumentMachine = -11,
    /// The argument `from` is an invalid pointer.
    ArgumentArms = -12,
    /// The argument `saved`, or one of its slots, is an invalid pointer.
    ArgumentSaved = -13,
    /// The argument `reading` is an invalid pointer.
    ArgumentReading = -14,
    /// The argument `directions` or `at` is an invalid pointer.
    ArgumentDirections = -15,
    /// The argument `bytes` is an invalid pointer.
    ArgumentBytes = -16,
    /// The argument `failure` is neither GLIMPSE_STATUS_MACHINE nor GLIMPSE_STATUS_STORAGE.
    ArgumentFailure = -17,
    /// The argument `calibration` is an invalid pointer, or its footprint is not one of glimpse_footprint.
    ArgumentCalibration = -18,
    /// The argument `counts` is an invalid pointer.
    ArgumentCounts = -19,
    /// The argument `repeated` is an invalid pointer.
    ArgumentRepeated = -20,
    /// The argument `buffer` or `values` is an invalid pointer.
    ArgumentBuffer = -21,
    /// An argument that receives a result is an invalid pointer.
    ArgumentResult = -22,

    /// Success.
    Ok = 0,
    /// The buffer is too small for the result.
    BufferTooSmall = 5,
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
    /// The driver's scan is finished, has failed, or does not exist: it takes no readings.
    NotScanning = 22,
    /// No intact readings are saved.
    SavedDamaged = 23,
    /// The saved readings belong to another recipe.
    SavedRecipe = 24,
    /// The white's counts are not above the dark counts.
    WhiteNotBrighter = 25,
    /// The white's reflectance is not above 0 and at most 2.
    WhiteReflectance = 26,
    /// The white is saturated.
    WhiteSaturated = 27,

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
    /// A field of the recipe holds a number out of range.
    RecipeRange = 43,
    /// The machine's limits are invalid.
    Limits = 44,
    /// The recipe has a required section that this library does not know.
    RecipeUnknown = 45,
    /// The recipe's sections are invalid or out of order.
    RecipeSections = 46,
    /// The recipe's header states other sizes than its sections have.
    RecipeHeader = 47,

    /// The recipe's model is not the one that this library was built for.
    Model = 48,
    /// The memory is too small for the recipe: see glimpse_scan_bytes() and glimpse_driver_bytes().
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
    ReadingsTooLarge = 80,
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
    /// Samples or directions are out of reach of the arms.
    OutOfReach = 105,
    /// The host refused: it does not support this request.
    RefusedRequest = 106,
    /// The host refused for a reason that the device does not know.
    RefusedOther = 107,
    /// The device could not store a recipe.
    Storage = 108,
}

use glimpse_status as Status;

/// Defines the texts of these statuses, for which `glimpse-core` has no error code.
macro_rules! own_texts {
    ($($name:ident $text:literal)+) => {
        /// The statuses that `glimpse-core` has no error code for, with their texts.
        const OWN_TEXTS: &[(Status, &[u8])] = &[$((Status::$name, $text.to_bytes_with_nul()),)+];
    };
}

own_texts! {
    ArgumentScan c"argument `scan`: null or misaligned; check the status of glimpse_scan_begin"
    ArgumentDriver c"argument `driver`: null or misaligned; check the status of glimpse_driver_begin"
    Stale c"argument `scan` or `driver`: nothing is in use in this memory, or the other kind of handle"
    ReadOnly c"argument `scan`: it belongs to a driver; call functions of the driver to change it"
    ArgumentMemory c"argument `memory`: null or misaligned; declare it with GLIMPSE_MEMORY"
    ArgumentRecipe c"argument `recipe`: null, too long, or rejected although it is usable"
    ArgumentBasis c"argument `basis`: null or too long"
    ArgumentConfig c"argument `config`: null or misaligned; start with glimpse_config_default"
    ArgumentHost c"argument `config`: its field `host` is not one of glimpse_host"
    ArgumentTargetLoss c"argument `config`: its field `target_loss` is negative or NAN"
    ArgumentMachine c"argument `machine`, or that field of `config`: null, misaligned, or limits out of range (radians)"
    ArgumentArms c"argument `from`: null or misaligned"
    ArgumentSaved c"argument `saved`: null or misaligned, or one of its slots is null or too long"
    ArgumentReading c"argument `reading`: null or misaligned"
    ArgumentDirections c"argument `directions` or `at`: null or misaligned"
    ArgumentBytes c"argument `bytes`: null or too long"
    ArgumentFailure c"argument `failure`: neither GLIMPSE_STATUS_MACHINE nor GLIMPSE_STATUS_STORAGE"
    ArgumentCalibration c"argument `calibration`: null, misaligned, or its field `footprint` is not one of glimpse_footprint"
    ArgumentCounts c"argument `counts`: null or misaligned"
    ArgumentRepeated c"argument `repeated`: null or misaligned"
    ArgumentBuffer c"argument `buffer` or `values`: null, misaligned or too long"
    ArgumentResult c"argument for a result: null or misaligned"
    Ok c"success"
    Unknown c"an error that this library does not know: update the library"
    NonePending c"no sample is pending"
    NotRead c"this sample has no reading"
    NoFit c"no fit is under way: glimpse_fit_begin begins one, and a reading ends it"
    NotFitted c"no fit has been finished since the last reading: call glimpse_fit_finish"
    NoBasis c"Linear has no BRDF without a basis: call glimpse_scan_set_basis, or compute it on a host from the values"
}

/// Defines the texts of these statuses, and converts the error codes of `glimpse-core` with these names to them. The
/// numbers of an error code and its status are equal.
macro_rules! core_codes {
    ($($name:ident)+) => {
        /// The statuses of `glimpse-core`'s error codes, with their texts.
        const CORE_TEXTS: &[(Status, &[u8])] = &[$((Status::$name, {
            const TEXT: &str = ErrorCode::$name.text();
            &terminated::<{ TEXT.len().wrapping_add(1) }>(TEXT)
        }),)+];

        $(const _: () = assert!(Status::$name as i32 == ErrorCode::$name as i32);)+

        impl From<ErrorCode> for Status {
            fn from(code: ErrorCode) -> Self {
                match code {
                    $(ErrorCode::$name => Self::$name,)+
                    ErrorCode::ChannelNonFinite => Self::ReadingNonFinite,
                    ErrorCode::MaxThetaI
                    | ErrorCode::MaxThetaO
                    | ErrorCode::MinSeparation
                    | ErrorCode::InPlane
                    | ErrorCode::MissingAxis => Self::OutOfReach,
                    // Codes of functions that this library does not have.
                    _ => Self::Unknown,
                }
            }
        }
    };
}

core_codes! {
    BufferTooSmall
    Incomplete Unfinished NotScanning SavedDamaged SavedRecipe WhiteNotBrighter WhiteReflectance WhiteSaturated
    RecipeMagic RecipeVersion RecipeLength RecipeChecksum RecipeMalformed RecipeCount RecipeNonFinite
    RecipeBelowHorizon RecipeRange Limits RecipeUnknown RecipeSections RecipeHeader
    Model Memory Basis BasisMagic BasisVersion BasisLength BasisChecksum BasisMalformed
    ReadingNonFinite ReadingNegative ReadingIndex ReadingRequired
    ReadingsTooLarge Diverged Directions Dark Repeated DeadRed DeadGreen DeadBlue Albedo Residual ImplausibleOther
    Machine Protocol NoReply
    RefusedNoScan RefusedDirections RefusedValues RefusedModel RefusedSaved RefusedRecipe OutOfReach
    RefusedRequest RefusedOther Storage
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

/// Returns every status with its zero-terminated text.
pub(crate) fn texts() -> impl Iterator<Item = (Status, &'static [u8])> {
    OWN_TEXTS.iter().chain(CORE_TEXTS).copied()
}

/// Returns the text of a status: an English sentence, zero-terminated, constant and never null. A number
/// that is not a status has a text, too.
#[unsafe(no_mangle)]
pub extern "C" fn glimpse_status_text(status: i32) -> *const c_char {
    let found = texts().find(|(known, _)| *known as i32 == status);
    let text = found.map_or(b"this number is not a status\0".as_slice(), |(_, text)| {
        text
    });
    text.as_ptr().cast()
}

/// Returns the version of this library, such as "0.3.0": zero-terminated, constant and never null. It
/// should equal the header's GLIMPSE_VERSION.
#[unsafe(no_mangle)]
pub extern "C" fn glimpse_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0")
        .as_ptr()
        .cast::<c_char>()
}

impl From<Error> for Status {
    fn from(error: Error) -> Self {
        error.code.into()
    }
}
