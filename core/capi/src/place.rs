//! What C hands over: pointers are checked before they are followed.
//!
//! Null and misalignment are found, and are errors by value. Whether a pointer leads to what its
//! type says, and who else uses it, only C knows: that is every function's contract.

use core::mem::MaybeUninit;

use crate::configuration::{
    ALIGNMENT, CDriver, CMemory, COMPONENTS, CScan, SAMPLES, driver_bytes, scan_bytes,
};
use crate::status::glimpse_status;

/// The caller's memory: a `Scan` or a `Driver`, and behind it what it borrows.
#[repr(C)]
pub(crate) struct Place<T> {
    handle: MaybeUninit<T>,
    memory: MaybeUninit<CMemory>,
}

const _: () = assert!(
    size_of::<Place<CScan>>() <= scan_bytes(SAMPLES, COMPONENTS),
    "GLIMPSE_SCAN_BYTES is too small: raise it in cbindgen.toml and configuration.rs"
);
const _: () = assert!(
    size_of::<Place<CDriver>>() <= driver_bytes(SAMPLES, COMPONENTS),
    "GLIMPSE_DRIVER_BYTES is too small: raise it in cbindgen.toml and configuration.rs"
);
const _: () = assert!(align_of::<Place<CDriver>>() <= ALIGNMENT);

impl<T> Place<T> {
    /// Checks the memory and empties it; returns where the handle goes, and what it may borrow.
    ///
    /// # Safety
    /// If it is neither null nor misaligned, `memory` leads to `bytes` bytes that may be written, and
    /// that nobody else uses while what is put there is in use.
    pub(crate) unsafe fn prepare(
        memory: *mut core::ffi::c_void,
        bytes: usize,
    ) -> Result<(*mut T, &'static mut CMemory), glimpse_status> {
        let place = memory.cast::<Self>();
        check(place)?;
        if bytes < size_of::<Self>() {
            return Err(glimpse_status::MemoryTooSmall);
        }
        // SAFETY: it is aligned and large enough; both are its fields, so inside of it.
        let (handle, memory) = unsafe { (&raw mut (*place).handle, &raw mut (*place).memory) };
        let memory = memory.cast::<CMemory>();
        // SAFETY: aligned and ours by the caller's word. This is the only reference to it, and
        // handles are made from `handle`, which does not overlap.
        let memory = unsafe {
            memory.write(CMemory::new());
            &mut *memory
        };
        Ok((handle.cast::<T>(), memory))
    }
}

fn check<T>(pointer: *const T) -> Result<(), glimpse_status> {
    if pointer.is_null() {
        return Err(glimpse_status::Null);
    }
    if !pointer.is_aligned() {
        return Err(glimpse_status::Misaligned);
    }
    Ok(())
}

/// A handle that is read.
///
/// # Safety
/// If it is neither null nor misaligned, `pointer` leads to a `T` that nobody changes for `'a`.
pub(crate) unsafe fn shared<'a, T>(pointer: *const T) -> Result<&'a T, glimpse_status> {
    check(pointer)?;
    // SAFETY: it was checked; the rest is the caller's word.
    Ok(unsafe { &*pointer })
}

/// A handle that is changed.
///
/// # Safety
/// If it is neither null nor misaligned, `pointer` leads to a `T` that nobody else uses for `'a`.
pub(crate) unsafe fn exclusive<'a, T>(pointer: *mut T) -> Result<&'a mut T, glimpse_status> {
    check(pointer)?;
    // SAFETY: it was checked; the rest is the caller's word.
    Ok(unsafe { &mut *pointer })
}

/// A list. A null pointer will do if there is nothing in it.
///
/// # Safety
/// If it is neither null nor misaligned, `pointer` leads to `count` of `T` that nobody changes for
/// `'a`.
pub(crate) unsafe fn list<'a, T>(
    pointer: *const T,
    count: usize,
) -> Result<&'a [T], glimpse_status> {
    if count == 0 {
        return Ok(&[]);
    }
    check(pointer)?;
    if count.saturating_mul(size_of::<T>()) > isize::MAX as usize {
        return Err(glimpse_status::Length);
    }
    // SAFETY: it was checked; the rest is the caller's word.
    Ok(unsafe { core::slice::from_raw_parts(pointer, count) })
}

/// An argument, copied.
///
/// # Safety
/// If it is neither null nor misaligned, `pointer` leads to a `T`.
pub(crate) unsafe fn get<T: Copy>(pointer: *const T) -> Result<T, glimpse_status> {
    check(pointer)?;
    // SAFETY: it was checked; the rest is the caller's word.
    Ok(unsafe { pointer.read() })
}

/// Where a result goes, checked.
pub(crate) struct Out<T>(*mut T);

impl<T> Out<T> {
    /// # Safety
    /// If it is neither null nor misaligned, `pointer` leads to room for a `T` until
    /// [`Out::put`].
    pub(crate) unsafe fn new(pointer: *mut T) -> Result<Self, glimpse_status> {
        check(pointer)?;
        Ok(Self(pointer))
    }

    /// Where a result goes that C may not want; then the pointer is null.
    ///
    /// # Safety
    /// As [`Out::new`].
    pub(crate) unsafe fn optional(pointer: *mut T) -> Result<Option<Self>, glimpse_status> {
        if pointer.is_null() {
            return Ok(None);
        }
        // SAFETY: by the caller's word.
        unsafe { Self::new(pointer) }.map(Some)
    }

    pub(crate) fn put(&self, value: T) {
        // SAFETY: by the word of whoever made it.
        unsafe { self.0.write(value) }
    }

    /// # Safety
    /// There is room for more than `index` of them.
    pub(crate) unsafe fn put_at(&self, index: usize, value: T) {
        // SAFETY: by the caller's word.
        unsafe { self.0.add(index).write(value) }
    }
}

/// What a function returns.
pub(crate) fn status(outcome: Result<(), glimpse_status>) -> glimpse_status {
    match outcome {
        Ok(()) => glimpse_status::Ok,
        Err(status) => status,
    }
}
