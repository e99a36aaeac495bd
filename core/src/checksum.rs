//! The CRC-32 of recipes, compact bases, link frames and saved readings.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

// No table: flash is scarcer than time here.
const CRC_32: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Returns the CRC-32 (ISO-HDLC) of these parts, one after the other.
///
/// Out of line, so that firmware holds it once.
#[must_use]
#[inline(never)]
pub fn crc_32(parts: &[&[u8]]) -> u32 {
    let mut digest = CRC_32.digest();
    for part in parts {
        digest.update(part);
    }
    digest.finalize()
}
