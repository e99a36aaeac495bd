//! What a module has once. A page's WebAssembly has a single thread.

use core::cell::UnsafeCell;

/// A value for a single thread.
pub(crate) struct Single<T>(UnsafeCell<T>);

// SAFETY: the module is built without threads, and nothing here is called back from within.
unsafe impl<T> Sync for Single<T> {}

impl<T> Single<T> {
    pub(crate) const fn new(value: T) -> Self {
        Self(UnsafeCell::new(value))
    }

    /// Uses it. Nothing that is called by `go_on` may use it again.
    pub(crate) fn with<R>(&'static self, go_on: impl FnOnce(&'static mut T) -> R) -> R {
        // SAFETY: exported functions are entered one after the other, each uses this once and leaves no
        // reference to it behind; what lives on in it is reached through it only.
        go_on(unsafe { &mut *self.0.get() })
    }
}
