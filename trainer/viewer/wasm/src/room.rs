//! Memory that a page writes to between two calls.

use core::arch::wasm32::memory_grow;

/// Bytes of a page of WebAssembly's memory.
const PAGE: usize = 1 << 16;

/// Bytes that a page of the web asked for: memory that WebAssembly's has grown by, and nobody else's.
pub(crate) struct Room {
    first: *mut u8,
    bytes: usize,
    capacity: usize,
}

impl Room {
    /// None if memory does not grow any more.
    pub(crate) fn new(bytes: usize) -> Option<Self> {
        let pages = bytes.div_ceil(PAGE).max(1);
        let page = memory_grow::<0>(pages);
        (page != usize::MAX).then(|| Self {
            first: (page * PAGE) as *mut u8,
            bytes,
            capacity: pages * PAGE,
        })
    }

    /// The same room for so many bytes, with what it held; None if it is too small.
    pub(crate) fn again(self, bytes: usize) -> Option<Self> {
        (bytes <= self.capacity).then_some(Self { bytes, ..self })
    }

    pub(crate) fn bytes(&mut self) -> &mut [u8] {
        // SAFETY: the pages are zeroed or written by the page, and only reached by way of this.
        unsafe { core::slice::from_raw_parts_mut(self.first, self.bytes) }
    }

    pub(crate) fn numbers(&mut self) -> &mut [f32] {
        // SAFETY: as above; pages are aligned, and every four bytes are a number.
        unsafe { core::slice::from_raw_parts_mut(self.first.cast(), self.bytes / 4) }
    }

    /// What is never written again, as the page promises.
    pub(crate) fn into_bytes(self) -> &'static [u8] {
        // SAFETY: the room is given up, so nothing reaches it but what comes back.
        unsafe { core::slice::from_raw_parts(self.first, self.bytes) }
    }
}
