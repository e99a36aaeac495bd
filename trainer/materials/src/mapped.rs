//! Files read in place, whatever their size.

use std::fs::File;
use std::path::Path;

use memmap2::Mmap;

use crate::SourceError;
use crate::error::refused;

/// Lets go of the pages of a mapped file that are in memory. They come back when they are looked at.
pub(super) fn release(mapped: &Mmap) {
    // SAFETY: the mapping is shared and read only, as all are that `map` makes: nothing was written
    // to it that could be lost, and the same bytes are read again from the file.
    #[cfg(unix)]
    let _ = unsafe { mapped.unchecked_advise(memmap2::UncheckedAdvice::DontNeed) };
    #[cfg(not(unix))]
    let _ = mapped;
}

/// Maps a file: nothing is allocated, and nothing of it is read before it is looked at.
pub(super) fn map(path: &Path) -> Result<Mmap, SourceError> {
    let file = File::open(path).map_err(refused(path))?;
    // SAFETY: nothing is assumed of the mapped bytes but that they can be read: every use copies
    // them out and accepts any value. What remains is what no reader of a mapped file can exclude:
    // if another program truncates it, this one is stopped by the system.
    unsafe { Mmap::map(&file) }.map_err(refused(path))
}
