//! The CRC-32 of recipes, compact bases, link frames and saved readings.

use crc::{CRC_32_ISO_HDLC, Crc, Table};

/// With a table of 1 kB: without one, parsing a recipe takes seven times as long as its fit.
static CRC_32: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// Returns the CRC-32 (ISO-HDLC) of some bytes.
#[must_use]
pub fn crc_32(bytes: &[u8]) -> u32 {
    crc_32_of_both(&[], bytes)
}

/// Returns the CRC-32 (ISO-HDLC) of a version and a length, in little endian, and the body behind them: the
/// checksum of recipes and compact bases.
#[must_use]
pub fn crc_32_of_file(version: u16, length: u32, body: &[u8]) -> u32 {
    let ([a, b], [c, d, e, f]) = (version.to_le_bytes(), length.to_le_bytes());
    crc_32_of_both(&[a, b, c, d, e, f], body)
}

/// Out of line, so that firmware holds it once. Two slices fit into the registers of all targets.
#[inline(never)]
fn crc_32_of_both(head: &[u8], body: &[u8]) -> u32 {
    let mut digest = CRC_32.digest();
    digest.update(head);
    digest.update(body);
    digest.finalize()
}
