//! Memory-mapped files.

use std::fs::File;
use std::path::Path;

use memmap2::Mmap;

use crate::SourceError;
use crate::error::read_error;

/// Releases the pages of a mapped file from memory. The next access reads them again.
pub(super) fn release(mapped: &Mmap) {
    // SAFETY: `map_file` makes shared, read-only mappings. No written data can be lost, and the next access reads the
    // same bytes from the file.
    #[cfg(unix)]
    let _ = unsafe { mapped.unchecked_advise(memmap2::UncheckedAdvice::DontNeed) };
    #[cfg(not(unix))]
    let _ = mapped;
}

/// Maps a file. Nothing is allocated, and pages are read on first access.
pub(super) fn map_file(path: &Path) -> Result<Mmap, SourceError> {
    let file = File::open(path).map_err(read_error(path))?;
    // SAFETY: every use copies the mapped bytes and accepts any value. One risk remains for every mapped file: if
    // another program truncates it, the operating system stops this process.
    unsafe { Mmap::map(&file) }.map_err(read_error(path))
}
