//! Buffers that the web page reads and writes between calls.

use core::arch::wasm32::memory_grow;

/// Size of a page of WebAssembly memory in bytes.
const PAGE: usize = 1 << 16;

/// A buffer that is alone in its memory pages. The length and the capacity are in bytes.
pub(crate) struct Buffer {
    first: *mut u8,
    length: usize,
    capacity: usize,
}

impl Buffer {
    /// Allocates a buffer; None if memory is exhausted.
    pub(crate) fn new(length: usize) -> Option<Self> {
        let pages = length.div_ceil(PAGE).max(1);
        let page = memory_grow::<0>(pages);
        (page != usize::MAX).then(|| Self {
            first: (page * PAGE) as *mut u8,
            length,
            capacity: pages * PAGE,
        })
    }

    /// Resizes the buffer within its capacity and keeps its content; None if the capacity is too small.
    pub(crate) fn resized(self, length: usize) -> Option<Self> {
        (length <= self.capacity).then_some(Self { length, ..self })
    }

    pub(crate) fn bytes(&mut self) -> &mut [u8] {
        // SAFETY: the memory is initialized, and only this buffer refers to it.
        unsafe { core::slice::from_raw_parts_mut(self.first, self.length) }
    }

    pub(crate) fn numbers(&mut self) -> &mut [f32] {
        // SAFETY: as above. Memory pages are aligned for `f32`, and all bit patterns are valid.
        unsafe { core::slice::from_raw_parts_mut(self.first.cast(), self.length / 4) }
    }

    /// Converts the buffer to a slice; the web page must not write to it afterwards.
    pub(crate) fn into_bytes(self) -> &'static [u8] {
        // SAFETY: the buffer is consumed, so only the returned slice refers to its memory.
        unsafe { core::slice::from_raw_parts(self.first, self.length) }
    }
}
