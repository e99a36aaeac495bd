//! Statuses of calls, with their numbers and texts.

use core::ffi::{CStr, c_char};

use glimpse_core::error::{Error, ErrorCode};

/// The status of a call: 0 on success. glimpse_status_text() returns its text.
///
/// A negative status names an invalid argument: the program has a defect. A pointer argument is invalid if
/// it is null although it is required, if it does not have the alignment of its type, or if its array
/// exceeds the address space.
///
/// After a status other than GLIMPSE_STATUS_OK nothing has changed and no result is written, unless the
/// function states otherwise. The meaning of a number never changes.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct glimpse_status(i32);

use glimpse_status as Status;

/// Defines the statuses for which `glimpse-core` has no error code, with their numbers and texts.
macro_rules! own_statuses {
    ($($name:ident = $number:literal, $text:literal;)+) => {
        #[allow(non_upper_case_globals)]
        impl Status {
            $(pub(crate) const $name: Self = Self($number);)+
        }

        /// The numbers of these statuses, their names, and their texts.
        pub(crate) const OWN: &[(i32, &str, &CStr)] = &[$(($number, stringify!($name), $text),)+];
    };
}

own_statuses! {
    ArgumentScan = -1, c"argument `scan`: null or misaligned; check the status of glimpse_scan_begin";
    ArgumentDriver = -2, c"argument `driver`: null or misaligned; check the status of glimpse_driver_begin";
    Stale = -3, c"argument `scan` or `driver`: nothing is in use in this memory, or the other kind of handle";
    ReadOnly = -4, c"argument `scan`: it belongs to a driver; call functions of the driver to change it";
    ArgumentMemory = -5, c"argument `memory`: null or misaligned; declare it with GLIMPSE_MEMORY";
    ArgumentRecipe = -6, c"argument `recipe`: null or too long";
    ArgumentBasis = -7, c"argument `basis`: null or too long";
    ArgumentConfig = -8, c"argument `config`: null or misaligned; start with glimpse_config_default";
    ArgumentHost = -9, c"argument `config`: its field `host` is not one of glimpse_host";
    ArgumentTargetLoss = -10, c"argument `config`: its field `target_loss` is negative or NAN";
    ArgumentMachine = -11, c"argument `machine`, or that field of `config`: null, misaligned, or limits out of range (radians)";
    ArgumentArms = -12, c"argument `from`: null or misaligned";
    ArgumentFlash = -13, c"argument `flash`: null or misaligned, or one of its callbacks is null";
    ArgumentReading = -14, c"argument `reading`: null or misaligned";
    ArgumentDirections = -15, c"argument `directions` or `at`: null or misaligned";
    ArgumentBytes = -16, c"argument `bytes`: null or too long";
    ArgumentFailure = -17, c"argument `failure`: neither a failure of the machine (GLIMPSE_STATUS_MACHINE, or 128 to 159) nor GLIMPSE_STATUS_STORAGE";
    ArgumentCalibration = -18, c"argument `calibration`: null, misaligned, or its field `footprint` is not one of glimpse_footprint";
    ArgumentCounts = -19, c"argument `counts`: null or misaligned";
    ArgumentRepeated = -20, c"argument `repeated`: null or misaligned";
    ArgumentValues = -21, c"argument `values`: null or misaligned";
    ArgumentResult = -22, c"argument for a result: null or misaligned";
    Ok = 0, c"success";
    NonePending = 16, c"no sample is pending";
    NotRead = 17, c"this sample has no reading";
    NoFit = 19, c"no fit is under way: glimpse_fit_begin begins one, and a reading ends it";
    NotFitted = 21, c"no fit has been finished since the last reading: call glimpse_fit_finish";
    NoBasis = 83, c"Linear has no BRDF without a basis: call glimpse_scan_set_basis, or compute it on a host from the values";
}

/// The numbers of an error code and of its status are equal.
impl From<ErrorCode> for Status {
    fn from(code: ErrorCode) -> Self {
        Self(code.number().into())
    }
}

impl From<Error> for Status {
    fn from(error: Error) -> Self {
        error.code.into()
    }
}

/// Returns the text of a status: an English sentence, zero-terminated, constant and never null. A number
/// that is not a status has a text, too.
#[unsafe(no_mangle)]
pub extern "C" fn glimpse_status_text(status: i32) -> *const c_char {
    if let Some((.., text)) = OWN.iter().find(|(number, ..)| *number == status) {
        return text.as_ptr();
    }
    let code = ErrorCode::from_number(u16::try_from(status).unwrap_or_default());
    code.zero_terminated_text().as_ptr().cast()
}

/// Returns the version of this library, such as "0.3.0": zero-terminated, constant and never null. It
/// should equal the header's GLIMPSE_VERSION.
#[unsafe(no_mangle)]
pub extern "C" fn glimpse_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}
