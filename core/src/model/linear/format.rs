//! Constants of the compact basis format, which `docs/basis.md` documents.

use crate::error::ErrorCode;
use crate::file::FileFormat;

/// The header of a compact basis.
pub const FORMAT: FileFormat = FileFormat {
    magic: *b"GLMC",
    version: 1,
    min_body_bytes: SHAPE_BYTES,
    errors: [
        ErrorCode::BasisMagic,
        ErrorCode::BasisVersion,
        ErrorCode::BasisLength,
        ErrorCode::BasisChecksum,
    ],
};
/// Bytes of a body before its lists: the basis's checksum, components, nodes, and the mean's scale.
pub const SHAPE_BYTES: usize = 16;
/// Bytes of a node before its row: the mean, and the row's scale.
pub const NODE_HEAD_BYTES: usize = 4;
/// The largest number of components of a compact basis.
pub const MAX_COMPONENTS: u16 = 1024;
