//! Checks of the pointers that C passes.
//!
//! Null and misaligned pointers are errors by value. Only C knows if a pointer leads to a value of its type, and who
//! else uses that value: this is the contract of every function.

use glimpse_core::recipe::Recipe;

use crate::configuration::CScan;
use crate::status::glimpse_status;

/// Bytes of a number that a scan works in.
const WORD_BYTES: usize = 4;
const _: () = assert!(size_of::<f32>() == WORD_BYTES);

/// The caller's memory: a handle at its front, and behind it the numbers that a scan works in.
pub(crate) struct Place<T> {
    handle: *mut T,
    words: usize,
}

impl<T> Place<T> {
    /// Checks the memory.
    ///
    /// # Safety
    /// If it is neither null nor misaligned, `memory` leads to `bytes` writable bytes, which nobody else uses while
    /// the handle is in use.
    pub(crate) unsafe fn new(
        memory: *mut core::ffi::c_void,
        bytes: usize,
    ) -> Result<Self, glimpse_status> {
        let handle = memory.cast::<T>();
        check(handle)?;
        let behind = bytes
            .checked_sub(size_of::<T>())
            .ok_or(glimpse_status::MemoryTooSmall)?;
        Ok(Self {
            handle,
            words: behind / WORD_BYTES,
        })
    }

    /// Number of words (of 4 bytes) behind the handle.
    pub(crate) fn words(&self) -> usize {
        self.words
    }

    /// Writes the handle. `make` receives the first `words` numbers behind it, set to 0.
    pub(crate) fn put<E>(
        self,
        words: usize,
        make: impl FnOnce(&'static mut [f32]) -> Result<T, E>,
    ) -> Result<*mut T, E> {
        const { assert!(align_of::<T>() >= align_of::<f32>()) };
        let words = words.min(self.words);
        // SAFETY: `Place::new` checked the alignment, and that the memory has room for the handle and for `words`
        // numbers behind it. Nobody else uses it, by the caller's word, and the two do not overlap.
        unsafe {
            let first = self.handle.add(1).cast::<f32>();
            first.write_bytes(0, words);
            let numbers = core::slice::from_raw_parts_mut(first, words);
            self.handle.write(make(numbers)?);
        }
        Ok(self.handle)
    }
}

/// Bytes of memory for a handle `T` and a scan with this recipe. 0 if this library does not accept the recipe.
///
/// # Safety
/// As [`list`].
pub(crate) unsafe fn bytes_for<T>(recipe: *const u8, count: usize) -> usize {
    // SAFETY: by the caller's word.
    let Ok(recipe) = (unsafe { list(recipe, count) }) else {
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

/// A handle to read from.
///
/// # Safety
/// If it is neither null nor misaligned, `pointer` leads to a `T`, which nobody changes for `'a`.
pub(crate) unsafe fn shared<'a, T>(pointer: *const T) -> Result<&'a T, glimpse_status> {
    check(pointer)?;
    // SAFETY: it was checked; the rest is the caller's word.
    Ok(unsafe { &*pointer })
}

/// A handle to change.
///
/// # Safety
/// If it is neither null nor misaligned, `pointer` leads to a `T`, which nobody else uses for `'a`.
pub(crate) unsafe fn exclusive<'a, T>(pointer: *mut T) -> Result<&'a mut T, glimpse_status> {
    check(pointer)?;
    // SAFETY: it was checked; the rest is the caller's word.
    Ok(unsafe { &mut *pointer })
}

/// A list. The pointer may be null if the list is empty.
///
/// # Safety
/// If it is neither null nor misaligned, `pointer` leads to `count` values of `T`, which nobody changes
/// for `'a`.
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

/// A copy of an argument.
///
/// # Safety
/// If it is neither null nor misaligned, `pointer` leads to a `T`.
pub(crate) unsafe fn get<T: Copy>(pointer: *const T) -> Result<T, glimpse_status> {
    check(pointer)?;
    // SAFETY: it was checked; the rest is the caller's word.
    Ok(unsafe { pointer.read() })
}

/// The checked place of a result.
pub(crate) struct Out<T>(*mut T);

impl<T> Out<T> {
    /// # Safety
    /// If it is neither null nor misaligned, `pointer` leads to room for a `T` until
    /// [`Out::put`].
    pub(crate) unsafe fn new(pointer: *mut T) -> Result<Self, glimpse_status> {
        check(pointer)?;
        Ok(Self(pointer))
    }

    /// The place of an optional result: None if the pointer is null.
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
        // SAFETY: by the word of the caller of `Out::new`.
        unsafe { self.0.write(value) }
    }

    /// # Safety
    /// There is room for more than `index` values.
    pub(crate) unsafe fn put_at(&self, index: usize, value: T) {
        // SAFETY: by the caller's word.
        unsafe { self.0.add(index).write(value) }
    }
}

/// The return value of a function.
pub(crate) fn status(outcome: Result<(), glimpse_status>) -> glimpse_status {
    match outcome {
        Ok(()) => glimpse_status::Ok,
        Err(status) => status,
    }
}
