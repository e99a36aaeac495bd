//! Checks of the pointers from C.
//!
//! For a null or misaligned pointer a function returns a status. The caller guarantees that any other pointer points to
//! values of its type, and that no other code uses these values during a call.

use glimpse_core::recipe::Recipe;

use crate::configuration::CScan;
use crate::status::glimpse_status;

/// Size of a word of a scan's memory, in bytes.
const WORD_BYTES: usize = 4;
const _: () = assert!(size_of::<f32>() == WORD_BYTES);

/// The caller's memory: a handle at its front, followed by the words of a scan.
pub(crate) struct CallerMemory<T> {
    handle: *mut T,
    words: usize,
}

impl<T> CallerMemory<T> {
    /// Checks the memory.
    ///
    /// # Safety
    /// `memory` is null, misaligned, or points to `bytes` writable bytes that no other code uses while the handle is in
    /// use.
    pub(crate) unsafe fn new(
        memory: *mut core::ffi::c_void,
        bytes: usize,
    ) -> Result<Self, glimpse_status> {
        let handle = memory.cast::<T>();
        check(handle)?;
        let scan_bytes = bytes
            .checked_sub(size_of::<T>())
            .ok_or(glimpse_status::MemoryTooSmall)?;
        Ok(Self {
            handle,
            words: scan_bytes / WORD_BYTES,
        })
    }

    /// Returns the number of words (of 4 bytes) behind the handle.
    pub(crate) fn words(&self) -> usize {
        self.words
    }

    /// Writes the handle and returns it. `make` receives the first `words` words behind the handle, set to 0.
    pub(crate) fn put<E>(
        self,
        words: usize,
        make: impl FnOnce(&'static mut [f32]) -> Result<T, E>,
    ) -> Result<*mut T, E> {
        const { assert!(align_of::<T>() >= align_of::<f32>()) };
        let words = words.min(self.words);
        // SAFETY: `CallerMemory::new` has checked the alignment, and that the handle and `words` words fit. They do not
        // overlap, and the caller guarantees that no other code uses the memory.
        unsafe {
            let first = self.handle.add(1).cast::<f32>();
            first.write_bytes(0, words);
            let scan_memory = core::slice::from_raw_parts_mut(first, words);
            self.handle.write(make(scan_memory)?);
        }
        Ok(self.handle)
    }
}

/// Returns the size of the memory for a handle `T` and a scan with this recipe, in bytes. Returns 0 if this library
/// does not accept the recipe.
///
/// # Safety
/// As [`slice`].
pub(crate) unsafe fn bytes_for<T>(recipe: *const u8, count: usize) -> usize {
    // SAFETY: guaranteed by the caller.
    let Ok(recipe) = (unsafe { slice(recipe, count) }) else {
        return 0;
    };
    let words = Recipe::parse(recipe)
        .ok()
        .and_then(|recipe| CScan::accept(&recipe, usize::MAX).ok());
    words.map_or(0, |words| {
        size_of::<T>().saturating_add(words.saturating_mul(WORD_BYTES))
    })
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

/// Returns a shared reference.
///
/// # Safety
/// `pointer` is null, misaligned, or points to a `T` that no code changes for `'a`.
pub(crate) unsafe fn shared<'a, T>(pointer: *const T) -> Result<&'a T, glimpse_status> {
    check(pointer)?;
    // SAFETY: the pointer was checked; the caller guarantees the rest.
    Ok(unsafe { &*pointer })
}

/// Returns an exclusive reference.
///
/// # Safety
/// `pointer` is null, misaligned, or points to a `T` that no other code uses for `'a`.
pub(crate) unsafe fn exclusive<'a, T>(pointer: *mut T) -> Result<&'a mut T, glimpse_status> {
    check(pointer)?;
    // SAFETY: the pointer was checked; the caller guarantees the rest.
    Ok(unsafe { &mut *pointer })
}

/// Returns a slice. The pointer may be null if `count` is 0.
///
/// # Safety
/// `pointer` is null, misaligned, or points to `count` values of `T` that no code changes for `'a`.
pub(crate) unsafe fn slice<'a, T>(
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
    // SAFETY: the pointer was checked; the caller guarantees the rest.
    Ok(unsafe { core::slice::from_raw_parts(pointer, count) })
}

/// Returns a copy of an argument.
///
/// # Safety
/// `pointer` is null, misaligned, or points to a `T`.
pub(crate) unsafe fn copy_of<T: Copy>(pointer: *const T) -> Result<T, glimpse_status> {
    check(pointer)?;
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
    pub(crate) unsafe fn new(pointer: *mut T) -> Result<Self, glimpse_status> {
        check(pointer)?;
        Ok(Self(pointer))
    }

    /// Checks the pointer to an optional result. Returns None if it is null.
    ///
    /// # Safety
    /// As [`Out::new`].
    pub(crate) unsafe fn optional(pointer: *mut T) -> Result<Option<Self>, glimpse_status> {
        if pointer.is_null() {
            return Ok(None);
        }
        // SAFETY: guaranteed by the caller.
        unsafe { Self::new(pointer) }.map(Some)
    }

    pub(crate) fn put(&self, value: T) {
        // SAFETY: guaranteed by the caller of `Out::new`.
        unsafe { self.0.write(value) }
    }

    /// Writes to an array of results.
    ///
    /// # Safety
    /// The pointer points to writable memory for more than `index` values.
    pub(crate) unsafe fn put_at(&self, index: usize, value: T) {
        // SAFETY: guaranteed by the caller.
        unsafe { self.0.add(index).write(value) }
    }
}

/// Converts the result of a function to its status.
pub(crate) fn status(result: Result<(), glimpse_status>) -> glimpse_status {
    match result {
        Ok(()) => glimpse_status::Ok,
        Err(status) => status,
    }
}
