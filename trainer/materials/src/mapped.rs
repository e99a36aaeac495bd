//! Memory-mapped files.

use std::fs::File;
use std::path::Path;

use memmap2::{Mmap, MmapOptions};

use crate::SourceError;
use crate::error::read_error;

/// Maps a file. Nothing is allocated, and pages are read on first access. If the map is made writable, changes stay in
/// memory.
pub(super) fn map_file(path: &Path) -> Result<Mmap, SourceError> {
    let file = File::open(path).map_err(read_error(path))?;
    // SAFETY: every use copies the mapped bytes and accepts any value. One risk remains for every mapped file: if
    // another program truncates it, the operating system stops this process.
    unsafe { MmapOptions::new().map_copy_read_only(&file) }.map_err(read_error(path))
}
