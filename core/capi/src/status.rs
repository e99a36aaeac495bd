//! What functions return: well, or why not, with a text for each.

use core::ffi::{CStr, c_char};

use glimpse_core::link::{Failure, Refusal};
use glimpse_core::model::linear::BasisError;
use glimpse_core::recipe::RecipeError;
use glimpse_core::scan::{FinishError, FitError, ReadingError, ScanError};

/// What every function returns: 0 if all went well. glimpse_status_text() has a sentence for each,
/// with what helps.
///
/// After anything else than GLIMPSE_STATUS_OK nothing has changed and no result was written, unless a
/// function says otherwise. Numbers are never given to something else.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum glimpse_status {
    /// All went well.
    Ok = 0,
    /// A pointer is null that must not be.
    Null = 1,
    /// A pointer is not aligned as its type asks, or memory not to GLIMPSE_ALIGNMENT.
    Misaligned = 2,
    /// The memory has fewer bytes than the library was built for.
    MemoryTooSmall = 3,
    /// A length is larger than memory can be.
    Length = 4,
    /// The buffer has no room for the result.
    BufferTooSmall = 5,
    /// An argument is none of the values that it can have.
    Argument = 6,

    /// There is no sample left to read; this ends a loop.
    NonePending = 16,
    /// This sample was not read yet.
    NotRead = 17,
    /// A reading is missing.
    Incomplete = 18,
    /// No fit is under way.
    NoFit = 19,
    /// The fit is not complete.
    Unfinished = 20,
    /// No fit has ended since the last reading.
    NotFitted = 21,
    /// The driver has no scan, since its recipe was refused.
    NoScan = 22,

    /// The bytes are no recipe.
    RecipeMagic = 32,
    /// The recipe has a format that this library does not read.
    RecipeVersion = 33,
    /// The recipe was cut or padded.
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
    /// The recipe is a descent, of a model that is not fitted by one.
    RecipeModel = 40,
    /// A field of the recipe holds 0 or less, where numbers have to be positive.
    RecipeNotPositive = 41,
    /// A field of the recipe holds a negative number.
    RecipeNegative = 42,
    /// A field of the recipe holds a number outside of its range.
    RecipeRange = 43,
    /// The limits that the recipe states are none.
    RecipeLimits = 44,
    /// The recipe has a section that this library does not know, and that it cannot do without.
    RecipeUnknown = 45,
    /// The recipe's sections are not those that a recipe has.
    RecipeSections = 46,

    /// The recipe is for another model than this library.
    Model = 48,
    /// The recipe has more samples than there is room for.
    Samples = 49,
    /// The recipe has more components than there is room for.
    Components = 50,
    /// The basis is not the recipe's.
    Basis = 51,
    /// The bytes are no compact basis.
    BasisMagic = 52,
    /// The basis has a format that this library does not read.
    BasisVersion = 53,
    /// The basis was cut or padded.
    BasisLength = 54,
    /// The basis's bytes were altered.
    BasisChecksum = 55,
    /// The basis has an impossible count or scale.
    BasisMalformed = 56,

    /// A channel of the reading is NaN or infinite.
    ReadingNonFinite = 64,
    /// A channel of the reading is further below 0 than noise can be.
    ReadingNegative = 65,
    /// The recipe has no sample with this index.
    ReadingIndex = 66,

    /// The readings are too large for a BRDF.
    Implausible = 80,
    /// The fit diverged.
    Diverged = 81,
    /// A direction is below the horizon, not finite or not of unit length.
    Directions = 82,
    /// Linear's BRDF cannot be told without a basis.
    NoBasis = 83,

    /// The device's own arms or sensor failed.
    Machine = 96,
    /// The host speaks another version of the protocol.
    Protocol = 97,
    /// The host does not reply.
    NoReply = 98,
    /// The host refused: no scan has begun.
    RefusedNoScan = 99,
    /// The host refused: it cannot reach these directions.
    RefusedDirections = 100,
    /// The host refused: the model has another number of values.
    RefusedValues = 101,
    /// The host refused: it cannot do with this model.
    RefusedModel = 102,
    /// The host refused: it did not give this reading.
    RefusedKept = 103,
    /// The host refused: it sends another recipe than it offered.
    RefusedRecipe = 104,
}

use glimpse_status as Status;

/// Every status and its text; README.md's table has the same.
pub(crate) const TEXTS: &[(Status, &CStr)] = &[
    (Status::Ok, c"all went well"),
    (
        Status::Null,
        c"a pointer is null: look at the status of the call that it came from",
    ),
    (
        Status::Misaligned,
        c"a pointer is not aligned as its type asks: declare memory by GLIMPSE_MEMORY",
    ),
    (
        Status::MemoryTooSmall,
        c"the memory has fewer bytes than the library was built for: define GLIMPSE_SAMPLES and GLIMPSE_COMPONENTS as they were set when it was built",
    ),
    (Status::Length, c"a length is larger than memory can be"),
    (
        Status::BufferTooSmall,
        c"the buffer has no room for the result: the count says how much it takes",
    ),
    (
        Status::Argument,
        c"an argument is none of the values that it can have",
    ),
    (Status::NonePending, c"there is no sample left to read"),
    (Status::NotRead, c"this sample was not read yet"),
    (
        Status::Incomplete,
        c"a reading is missing: glimpse_scan_next says which",
    ),
    (
        Status::NoFit,
        c"no fit is under way: glimpse_fit_begin begins one, a reading ends it",
    ),
    (
        Status::Unfinished,
        c"the fit is not complete: call glimpse_fit_advance until done is total",
    ),
    (
        Status::NotFitted,
        c"no fit has ended since the last reading: call glimpse_fit_finish",
    ),
    (
        Status::NoScan,
        c"the driver has no scan, since its recipe was refused",
    ),
    (
        Status::RecipeMagic,
        c"this is not a recipe: it does not begin with GLMP",
    ),
    (
        Status::RecipeVersion,
        c"the recipe has a format that this library does not read: train again, or take a newer library",
    ),
    (
        Status::RecipeLength,
        c"the recipe has another length than it says: it was cut or padded",
    ),
    (
        Status::RecipeChecksum,
        c"the recipe's checksum is wrong: its bytes were altered",
    ),
    (
        Status::RecipeMalformed,
        c"the recipe's body does not follow the format",
    ),
    (
        Status::RecipeCount,
        c"a field of the recipe has an impossible count",
    ),
    (
        Status::RecipeNonFinite,
        c"a field of the recipe holds a NaN or an infinity",
    ),
    (
        Status::RecipeBelowHorizon,
        c"a direction of the recipe's pattern is below the horizon",
    ),
    (
        Status::RecipeModel,
        c"the recipe is a descent, of a model that is not fitted by one",
    ),
    (
        Status::RecipeNotPositive,
        c"a field of the recipe holds a number that is not positive",
    ),
    (
        Status::RecipeNegative,
        c"a field of the recipe holds a negative number",
    ),
    (
        Status::RecipeRange,
        c"a field of the recipe holds a number outside of its range",
    ),
    (
        Status::RecipeLimits,
        c"the limits of a machine that the recipe states are none",
    ),
    (
        Status::RecipeUnknown,
        c"the recipe cannot be read without a section that this library does not know: take a newer library",
    ),
    (
        Status::RecipeSections,
        c"the recipe's sections are not those that a recipe has, or not in their order",
    ),
    (
        Status::Model,
        c"the recipe is for another model than this library: build it for that one or for all, or train for this one",
    ),
    (
        Status::Samples,
        c"the recipe has more samples than there is room for: raise GLIMPSE_SAMPLES, for the library and for C",
    ),
    (
        Status::Components,
        c"the recipe's fit takes more memory than there is: raise GLIMPSE_COMPONENTS, for the library and for C",
    ),
    (
        Status::Basis,
        c"the basis is not the one that the recipe names: export the recipe's own",
    ),
    (
        Status::BasisMagic,
        c"this is not a compact basis: trainer export --format basis writes one",
    ),
    (
        Status::BasisVersion,
        c"the compact basis has a format that this library does not read: export it again",
    ),
    (
        Status::BasisLength,
        c"the compact basis has another length than it says: it was cut or padded",
    ),
    (
        Status::BasisChecksum,
        c"the compact basis's checksum is wrong: its bytes were altered",
    ),
    (
        Status::BasisMalformed,
        c"the compact basis has an impossible count or scale: export it again",
    ),
    (
        Status::ReadingNonFinite,
        c"a channel of the reading is not a finite number",
    ),
    (
        Status::ReadingNegative,
        c"a channel of the reading is below -1 sr^-1, further than noise can be: look at the dark reading",
    ),
    (
        Status::ReadingIndex,
        c"the recipe's pattern has no sample with this index",
    ),
    (
        Status::Implausible,
        c"more than three quarters of the readings are above 10 sr^-1, which no material's are: readings are BRDFs in sr^-1, not counts",
    ),
    (
        Status::Diverged,
        c"the fit diverged: no material that the recipe knows reads so; look at the units (sr^-1, not counts) and at the sensor's range",
    ),
    (
        Status::Directions,
        c"a direction is below the horizon, not finite or not of unit length",
    ),
    (
        Status::NoBasis,
        c"Linear's BRDF cannot be told without a basis: glimpse_scan_set_basis, or a host makes it from the values",
    ),
    (
        Status::Machine,
        c"the device's own arms or sensor failed: its log says how",
    ),
    (
        Status::Protocol,
        c"the host speaks another version of the protocol",
    ),
    (Status::NoReply, c"the host does not reply"),
    (
        Status::RefusedNoScan,
        c"the host refused: no scan has begun, say hello first",
    ),
    (
        Status::RefusedDirections,
        c"the host refused: the scanner cannot reach these directions",
    ),
    (
        Status::RefusedValues,
        c"the host refused: the model has another number of values",
    ),
    (
        Status::RefusedModel,
        c"the host refused: it cannot do with this model",
    ),
    (
        Status::RefusedKept,
        c"the host refused: it did not give this reading, take all of them again",
    ),
    (
        Status::RefusedRecipe,
        c"the host refused: it sends another recipe than it offered",
    ),
];

/// A sentence in English that says what a status means and what helps. It ends in a zero, is
/// constant and never null; for a number that is no status it says so.
#[unsafe(no_mangle)]
pub extern "C" fn glimpse_status_text(status: i32) -> *const c_char {
    let mut texts = TEXTS.iter();
    let found = texts.find(|(known, _)| *known as i32 == status);
    found
        .map_or(c"this number is no status", |(_, text)| *text)
        .as_ptr()
}

/// The version of this library, as "0.2.0"; GLIMPSE_VERSION is the header's, and should be the same. It
/// ends in a zero, is constant and never null.
#[unsafe(no_mangle)]
pub extern "C" fn glimpse_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0")
        .as_ptr()
        .cast::<c_char>()
}

impl From<RecipeError> for Status {
    fn from(error: RecipeError) -> Self {
        match error {
            RecipeError::Magic => Self::RecipeMagic,
            RecipeError::Version(_) => Self::RecipeVersion,
            RecipeError::Length { .. } => Self::RecipeLength,
            RecipeError::Checksum => Self::RecipeChecksum,
            RecipeError::Malformed => Self::RecipeMalformed,
            RecipeError::Count(_) => Self::RecipeCount,
            RecipeError::NonFinite(_) => Self::RecipeNonFinite,
            RecipeError::BelowHorizon(_) => Self::RecipeBelowHorizon,
            RecipeError::BufferTooSmall => Self::BufferTooSmall,
            RecipeError::Model(_) => Self::RecipeModel,
            RecipeError::NotPositive(_) => Self::RecipeNotPositive,
            RecipeError::Negative(_) => Self::RecipeNegative,
            RecipeError::Range(_) => Self::RecipeRange,
            RecipeError::Limits(_) => Self::RecipeLimits,
            RecipeError::Unknown(_) => Self::RecipeUnknown,
            RecipeError::Order(_)
            | RecipeError::Section(_)
            | RecipeError::Missing(_)
            | RecipeError::Learners(_)
            | RecipeError::Required(_)
            | RecipeError::Beside(_)
            | RecipeError::Unused(_) => Self::RecipeSections,
        }
    }
}

impl From<BasisError> for Status {
    fn from(error: BasisError) -> Self {
        match error {
            BasisError::Magic => Self::BasisMagic,
            BasisError::Version(_) => Self::BasisVersion,
            BasisError::Length { .. } => Self::BasisLength,
            BasisError::Checksum => Self::BasisChecksum,
            BasisError::Components(_) | BasisError::Nodes | BasisError::Scale => {
                Self::BasisMalformed
            }
        }
    }
}

impl From<ScanError> for Status {
    fn from(error: ScanError) -> Self {
        match error {
            ScanError::Model { .. } => Self::Model,
            ScanError::Capacity { .. } => Self::Samples,
            ScanError::Words { .. } => Self::Components,
            ScanError::Basis { .. } => Self::Basis,
        }
    }
}

impl From<ReadingError> for Status {
    fn from(error: ReadingError) -> Self {
        match error {
            ReadingError::NonFinite(_) => Self::ReadingNonFinite,
            ReadingError::Negative(_) => Self::ReadingNegative,
            ReadingError::Index { .. } => Self::ReadingIndex,
        }
    }
}

impl From<FitError> for Status {
    fn from(error: FitError) -> Self {
        match error {
            FitError::Incomplete { .. } => Self::Incomplete,
            FitError::Implausible { .. } => Self::Implausible,
        }
    }
}

impl From<FinishError> for Status {
    fn from(error: FinishError) -> Self {
        match error {
            FinishError::Unfinished(_) => Self::Unfinished,
            FinishError::Diverged => Self::Diverged,
        }
    }
}

impl From<Failure> for Status {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Recipe(error) => error.into(),
            Failure::Scan(error) => error.into(),
            Failure::Reading { error, .. } => error.into(),
            Failure::Fit(error) => error.into(),
            Failure::Machine => Self::Machine,
            Failure::Protocol { .. } => Self::Protocol,
            Failure::NoReply => Self::NoReply,
            Failure::Diverged => Self::Diverged,
            Failure::Refused(refusal) => match refusal {
                Refusal::NoScan => Self::RefusedNoScan,
                Refusal::Directions => Self::RefusedDirections,
                Refusal::Values => Self::RefusedValues,
                Refusal::Model => Self::RefusedModel,
                Refusal::Saved => Self::RefusedKept,
                Refusal::Recipe => Self::RefusedRecipe,
            },
        }
    }
}
