//! Buffers that the page reads and writes between calls.

use core::arch::wasm32::memory_grow;

/// Size of a page of WebAssembly memory in bytes.
const PAGE: usize = 1 << 16;

/// A buffer in memory pages that were allocated for it alone.
pub(crate) struct Buffer {
    first: *mut u8,
    bytes: usize,
    capacity: usize,
}

impl Buffer {
    /// Allocates a buffer; None if memory is exhausted.
    pub(crate) fn new(bytes: usize) -> Option<Self> {
        let pages = bytes.div_ceil(PAGE).max(1);
        let page = memory_grow::<0>(pages);
        (page != usize::MAX).then(|| Self {
            first: (page * PAGE) as *mut u8,
            bytes,
            capacity: pages * PAGE,
        })
    }

    /// Resizes the buffer within its capacity and keeps its content; None if the capacity is too small.
    pub(crate) fn resized(self, bytes: usize) -> Option<Self> {
        (bytes <= self.capacity).then_some(Self { bytes, ..self })
    }

    pub(crate) fn bytes(&mut self) -> &mut [u8] {
        // SAFETY: the memory is initialized, and only this buffer refers to it.
        unsafe { core::slice::from_raw_parts_mut(self.first, self.bytes) }
    }

    pub(crate) fn numbers(&mut self) -> &mut [f32] {
        // SAFETY: as above; pages are aligned, and all bit patterns are valid `f32`.
        unsafe { core::slice::from_raw_parts_mut(self.first.cast(), self.bytes / 4) }
    }

    /// Converts the buffer to a slice; the page must not write to it afterwards.
    pub(crate) fn into_bytes(self) -> &'static [u8] {
        // SAFETY: the buffer is consumed, so only the returned slice refers to its memory.
        unsafe { core::slice::from_raw_parts(self.first, self.bytes) }
    }
}
