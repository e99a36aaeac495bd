//! Constants of the compact basis format, which `docs/basis.md` documents.

use crate::checksum::crc_32_of_file;

/// The first bytes of every compact basis.
pub const MAGIC: [u8; 4] = *b"GLMC";
/// The format version of a compact basis that this crate reads.
pub const VERSION: u16 = 1;
/// Bytes of a compact basis before its body: magic, version, length and CRC-32.
pub const HEADER_BYTES: usize = 14;
/// Bytes of a body before its lists: the whole basis's checksum, components, nodes, and the mean's scale.
pub const SHAPE_BYTES: usize = 16;
/// Bytes of a node before its row: the mean, and the row's scale.
pub const NODE_HEAD_BYTES: usize = 4;
/// The largest number of components of a compact basis.
pub const MAX_COMPONENTS: u16 = 1024;

/// The CRC-32 for the header of a compact basis, over version, length and body.
#[must_use]
pub fn checksum_of(version: u16, length: u32, body: &[u8]) -> u32 {
    crc_32_of_file(version, length, body)
}
