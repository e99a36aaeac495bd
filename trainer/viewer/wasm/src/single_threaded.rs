//! Global state of a single-threaded WebAssembly module.

use core::cell::UnsafeCell;

/// A value for a single thread.
pub(crate) struct SingleThreaded<T>(UnsafeCell<T>);

// SAFETY: the module is built without threads, and exported functions are not reentrant.
unsafe impl<T> Sync for SingleThreaded<T> {}

impl<T> SingleThreaded<T> {
    pub(crate) const fn new(value: T) -> Self {
        Self(UnsafeCell::new(value))
    }

    /// Passes the value to `f`. Functions called by `f` must not call `with` on the same value.
    pub(crate) fn with<R>(&'static self, f: impl FnOnce(&'static mut T) -> R) -> R {
        // SAFETY: exported functions run one at a time. Each calls `with` once and keeps no reference afterwards.
        // References stored in the value are used only through the value.
        f(unsafe { &mut *self.0.get() })
    }
}
