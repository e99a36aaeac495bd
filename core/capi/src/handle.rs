//! Handles: a scan or a driver at the front of the caller's memory, behind a tag that identifies it.

use core::ffi::c_void;

use glimpse_core::driver::Driver;
use glimpse_core::error::ErrorCode;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;

use crate::pointer::{check, slice};
use crate::status::glimpse_status as Status;

// Two of these features define the type twice, which is an error. Select one of them, or none for all models.
#[cfg(feature = "only-phong")]
pub(crate) type ScanModel = glimpse_core::model::Phong;
#[cfg(feature = "only-cook-torrance")]
pub(crate) type ScanModel = glimpse_core::model::CookTorrance;
#[cfg(feature = "only-neural")]
pub(crate) type ScanModel = glimpse_core::model::Neural;
#[cfg(feature = "only-linear")]
pub(crate) type ScanModel = glimpse_core::fit::Linear;
#[cfg(not(any(
    feature = "only-phong",
    feature = "only-cook-torrance",
    feature = "only-neural",
    feature = "only-linear"
)))]
pub(crate) type ScanModel = glimpse_core::fit::AnyModel;

/// A scan of one material, in the caller's memory. Use it from one thread at a time, and not from an
/// interrupt handler that may interrupt a call.
pub struct glimpse_scan(());

/// A driver of scans, in the caller's memory. It takes received bytes, readings and the time, and returns
/// the next action. Motors, sensor, serial line, flash and clock belong to the firmware. Use it from one
/// thread at a time, and not from an interrupt handler that may interrupt a call.
pub struct glimpse_driver(());

/// The scan behind a handle. It borrows the caller's memory and recipe, whose lifetimes the caller guarantees.
pub(crate) type CScan = Scan<'static, ScanModel>;

/// The driver behind a handle. It borrows like a scan.
pub(crate) struct CDriver {
    pub(crate) driver: Driver<'static, ScanModel>,
    /// Time of the last poll, in ms.
    pub(crate) polled_at: u64,
}

impl CDriver {
    /// Extends a time in ms that wraps, at or after the last poll.
    pub(crate) fn time(&self, now_ms: u32) -> u64 {
        let since = now_ms.wrapping_sub(self.polled_at as u32);
        self.polled_at.saturating_add(since.into())
    }
}

/// The front of the caller's memory. The words of a scan follow it.
#[repr(C)]
pub(crate) struct Handle<T> {
    /// [`tag_of`] this handle while it is in use. 0 ends the use.
    pub(crate) tag: usize,
    pub(crate) value: T,
}

/// Kinds of handles.
pub(crate) trait Kind {
    /// An arbitrary number, different for each kind.
    const TAG: usize;
    /// The status of a handle that is null or misaligned.
    const ARGUMENT: Status;
}

impl Kind for CScan {
    const TAG: usize = 0x5CA9_71E5;
    const ARGUMENT: Status = Status::ArgumentScan;
}

impl Kind for CDriver {
    const TAG: usize = 0xD217_E25A;
    const ARGUMENT: Status = Status::ArgumentDriver;
}

/// The tag of a handle. It contains the address, so that a moved copy is refused: a scan points to its own memory.
fn tag_of<T: Kind>(handle: *const Handle<T>) -> usize {
    handle.addr() ^ T::TAG
}

/// Checks a handle from C.
///
/// # Safety
/// `pointer` is null, misaligned, or points to readable memory.
unsafe fn checked<T: Kind>(pointer: *const c_void) -> Result<*mut Handle<T>, Status> {
    let handle = pointer.cast_mut().cast::<Handle<T>>();
    check(handle, T::ARGUMENT)?;
    // SAFETY: the pointer was checked; the caller guarantees the rest. Only the tag is read.
    let tag = unsafe { (&raw const (*handle).tag).read() };
    let is_in_use = tag == tag_of(handle);
    is_in_use.then_some(handle).ok_or(Status::Stale)
}

/// Returns the handle of a kind behind a pointer, to change it.
///
/// # Safety
/// `pointer` is null, misaligned, or points to readable memory. No other code uses the handle for `'a`.
pub(crate) unsafe fn exclusive<'a, T: Kind>(
    pointer: *mut c_void,
) -> Result<&'a mut Handle<T>, Status> {
    // SAFETY: guaranteed by the caller.
    unsafe { checked(pointer).map(|handle| &mut *handle) }
}

/// Returns a driver.
///
/// # Safety
/// As [`exclusive`], but other code may read the handle.
pub(crate) unsafe fn driver<'a>(driver: *const glimpse_driver) -> Result<&'a CDriver, Status> {
    // SAFETY: guaranteed by the caller.
    unsafe { checked::<CDriver>(driver.cast()).map(|handle| &(*handle).value) }
}

/// Returns a driver, to change it.
///
/// # Safety
/// As [`exclusive`].
pub(crate) unsafe fn driver_mut<'a>(
    driver: *mut glimpse_driver,
) -> Result<&'a mut Driver<'static, ScanModel>, Status> {
    // SAFETY: guaranteed by the caller.
    unsafe { exclusive::<CDriver>(driver.cast()).map(|handle| &mut handle.value.driver) }
}

/// Returns a scan of its own, or that of a driver. The handle of a driver's scan is the driver's.
///
/// # Safety
/// As [`driver`].
pub(crate) unsafe fn scan<'a>(scan: *const glimpse_scan) -> Result<&'a CScan, Status> {
    // SAFETY: guaranteed by the caller.
    unsafe {
        match driver(scan.cast()) {
            Ok(handle) => Ok(handle.driver.scan()),
            Err(_) => checked::<CScan>(scan.cast()).map(|handle| &(*handle).value),
        }
    }
}

/// Returns a scan of its own, to change it. A driver's scan changes only with the driver.
///
/// # Safety
/// As [`exclusive`].
pub(crate) unsafe fn scan_mut<'a>(scan: *mut glimpse_scan) -> Result<&'a mut CScan, Status> {
    // SAFETY: guaranteed by the caller.
    unsafe {
        match checked::<CDriver>(scan.cast()) {
            Ok(_) => Err(Status::ReadOnly),
            Err(_) => exclusive(scan.cast()).map(|handle| &mut handle.value),
        }
    }
}

/// Size of a word of a scan's memory, in bytes.
const WORD_BYTES: usize = size_of::<f32>();

/// The caller's memory, before a handle is written to its front.
pub(crate) struct Memory<T> {
    handle: *mut Handle<T>,
    /// Words (of 4 bytes) behind the handle.
    pub(crate) words: usize,
}

impl<T: Kind> Memory<T> {
    /// Checks the memory.
    ///
    /// # Safety
    /// `memory` is null, misaligned, or points to `bytes` writable bytes that no other code uses while the handle is in
    /// use.
    pub(crate) unsafe fn new(memory: *mut c_void, bytes: usize) -> Result<Self, Status> {
        let handle = memory.cast::<Handle<T>>();
        check(handle, Status::ArgumentMemory)?;
        let bytes = bytes.checked_sub(size_of::<Handle<T>>());
        let words = bytes.ok_or(ErrorCode::Memory)? / WORD_BYTES;
        Ok(Self { handle, words })
    }

    /// Returns the words behind the handle, set to 0. Ends the use of an earlier handle.
    ///
    /// # Safety
    /// Call it at most once.
    pub(crate) unsafe fn numbers(&self) -> &'static mut [f32] {
        // SAFETY: `Memory::new` has checked the alignment, which is at least that of a word, and that the handle and
        // the words fit. They do not overlap, and the caller guarantees that no other code uses the memory.
        unsafe {
            (&raw mut (*self.handle).tag).write(0);
            let first = self.handle.add(1).cast::<f32>();
            first.write_bytes(0, self.words);
            core::slice::from_raw_parts_mut(first, self.words)
        }
    }

    /// Writes the handle and returns it. It writes each field, because a whole handle would be on the stack first.
    pub(crate) fn put(self, value: T) -> *mut Handle<T> {
        // SAFETY: guaranteed by the caller of `Memory::new`, which has checked the pointer.
        unsafe {
            (&raw mut (*self.handle).tag).write(tag_of(self.handle));
            (&raw mut (*self.handle).value).write(value);
        }
        self.handle
    }
}

/// Returns the size of the memory for a handle and a scan with this recipe, in bytes. Returns 0 if this library does not
/// accept the recipe.
///
/// # Safety
/// As [`slice`].
pub(crate) unsafe fn bytes_for<T>(recipe: *const u8, count: usize) -> usize {
    // SAFETY: guaranteed by the caller.
    let recipe = unsafe { slice(recipe, count, Status::ArgumentRecipe) };
    let recipe = recipe.ok().and_then(|recipe| Recipe::parse(recipe).ok());
    let words = recipe.and_then(|recipe| CScan::accept(&recipe, usize::MAX).ok());
    words.map_or(0, |words| {
        size_of::<Handle<T>>().saturating_add(words.saturating_mul(WORD_BYTES))
    })
}

/// `GLIMPSE_ALIGNMENT`.
pub(crate) const ALIGNMENT: usize = 8;

/// `GLIMPSE_SCAN_BYTES(0)`.
pub(crate) const SCAN_BYTES: usize = 69 * size_of::<usize>() + 160;
/// `GLIMPSE_DRIVER_BYTES(0)`.
pub(crate) const DRIVER_BYTES: usize = SCAN_BYTES + 648;

// If one of these is too small, raise it in cbindgen.toml, too.
const _: () = assert!(size_of::<Handle<CScan>>() <= SCAN_BYTES);
const _: () = assert!(size_of::<Handle<CDriver>>() <= DRIVER_BYTES);
const _: () = assert!(align_of::<Handle<CDriver>>() <= ALIGNMENT);
