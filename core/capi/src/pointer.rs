//! Checks of the pointers from C.
//!
//! For a null or misaligned pointer a function returns the status that names the argument. The caller guarantees that any
//! other pointer points to values of its type, and that no other code uses these values during a call.

use crate::status::glimpse_status as Status;

/// Checks that a pointer is neither null nor misaligned. `argument` is the status that names it.
pub(crate) fn check<T>(pointer: *const T, argument: Status) -> Result<(), Status> {
    let is_valid = !pointer.is_null() && pointer.is_aligned();
    is_valid.then_some(()).ok_or(argument)
}

/// Returns a slice. The pointer may be null if `count` is 0.
///
/// # Safety
/// `pointer` is null, misaligned, or points to `count` values of `T` that no code changes for `'a`.
pub(crate) unsafe fn slice<'a, T>(
    pointer: *const T,
    count: usize,
    argument: Status,
) -> Result<&'a [T], Status> {
    if count == 0 {
        return Ok(&[]);
    }
    check(pointer, argument)?;
    if count.saturating_mul(size_of::<T>()) > isize::MAX as usize {
        return Err(argument);
    }
    // SAFETY: the pointer was checked; the caller guarantees the rest.
    Ok(unsafe { core::slice::from_raw_parts(pointer, count) })
}

/// Returns a copy of an argument.
///
/// # Safety
/// `pointer` is null, misaligned, or points to a `T`.
pub(crate) unsafe fn copy<T: Copy>(pointer: *const T, argument: Status) -> Result<T, Status> {
    check(pointer, argument)?;
    // SAFETY: the pointer was checked; the caller guarantees the rest.
    Ok(unsafe { pointer.read() })
}

/// A checked pointer to a result.
pub(crate) struct Out<T>(*mut T);

impl<T> Out<T> {
    /// Checks the pointer.
    ///
    /// # Safety
    /// `pointer` is null, misaligned, or points to writable memory for a `T` until [`Out::put`].
    pub(crate) unsafe fn new(pointer: *mut T) -> Result<Self, Status> {
        check(pointer, Status::ArgumentResult)?;
        Ok(Self(pointer))
    }

    /// Checks the pointer to an optional result, which may be null.
    ///
    /// # Safety
    /// As [`Out::new`].
    pub(crate) unsafe fn optional(pointer: *mut T) -> Result<Self, Status> {
        match pointer.is_null() {
            true => Ok(Self(pointer)),
            // SAFETY: guaranteed by the caller.
            false => unsafe { Self::new(pointer) },
        }
    }

    /// Writes the result. Always succeeds, so that it can be the last expression of a call.
    pub(crate) fn put(&self, value: T) -> Result<(), Status> {
        if !self.0.is_null() {
            // SAFETY: guaranteed by the caller of `Out::new`.
            unsafe { self.0.write(value) }
        }
        Ok(())
    }
}

/// Makes a call, and returns its status.
pub(crate) fn status(call: impl FnOnce() -> Result<(), Status>) -> Status {
    call().err().unwrap_or(Status::Ok)
}
