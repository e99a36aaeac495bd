//! The header of recipes and compact bases: magic, version (u16), length of the body (u32), and the CRC-32 of version,
//! length and body (u32), little-endian.
use crate::checksum::crc_32_of_file;
use crate::error::{Error, ErrorCode};

/// Number of bytes before the body.
pub const HEADER_BYTES: usize = 14;

/// A file format.
#[derive(Debug)]
pub struct FileFormat {
    /// The first bytes.
    pub magic: [u8; 4],
    /// The only version that this crate reads.
    pub version: u16,
    /// The smallest length of a body.
    pub min_body_bytes: usize,
    /// The codes of a wrong magic, version, length, and checksum.
    pub errors: [ErrorCode; 4],
}

impl FileFormat {
    /// Returns the header of a file with this body.
    #[must_use]
    pub fn header(&self, body: &[u8]) -> [u8; HEADER_BYTES] {
        let length = body.len() as u32;
        let checksum = crc_32_of_file(self.version, length, body);
        let fields = [
            &self.magic[..],
            &self.version.to_le_bytes(),
            &length.to_le_bytes(),
            &checksum.to_le_bytes(),
        ];
        let mut header = [0; HEADER_BYTES];
        for (to, byte) in header.iter_mut().zip(fields.into_iter().flatten()) {
            *to = *byte;
        }
        header
    }

    /// Checks the header of a file. Returns the checksum and the body.
    pub(crate) fn read<'a>(&self, bytes: &'a [u8]) -> Result<(u32, Reader<'a>), Error> {
        let [wrong_magic, wrong_version, _, wrong_checksum] = self.errors;
        let mut reader = Reader(bytes);
        if reader.take() != self.magic {
            return Err(Error::new(wrong_magic));
        }
        let too_short = self.length_error(self.min_body_bytes, bytes.len());
        if bytes.len() < HEADER_BYTES {
            return Err(too_short);
        }
        let (version, length, checksum) = (reader.u16(), reader.u32(), reader.u32());
        let Reader(body) = reader;
        if version != self.version {
            return Err(Error::with(wrong_version, [version.into(), 0]));
        }
        if u32::try_from(body.len()) != Ok(length) {
            return Err(self.length_error(length as usize, bytes.len()));
        }
        if checksum != crc_32_of_file(version, length, body) {
            return Err(Error::new(wrong_checksum));
        }
        if body.len() < self.min_body_bytes {
            return Err(too_short);
        }
        Ok((checksum, reader))
    }

    /// Returns the error of a body that should have another length, in a file of `found` bytes.
    pub(crate) fn length_error(&self, body: usize, found: usize) -> Error {
        let [_, _, code, _] = self.errors;
        let lengths = [body.saturating_add(HEADER_BYTES), found];
        Error::with(
            code,
            lengths.map(|length| u32::try_from(length).unwrap_or(u32::MAX)),
        )
    }
}

/// A reader of little-endian numbers. After the end they are 0.
pub(crate) struct Reader<'a>(pub(crate) &'a [u8]);

impl Reader<'_> {
    pub(crate) fn take<const N: usize>(&mut self) -> [u8; N] {
        let (bytes, rest) = self.0.split_first_chunk().unwrap_or((&[0; N], &[]));
        self.0 = rest;
        *bytes
    }

    pub(crate) fn u16(&mut self) -> u16 {
        u16::from_le_bytes(self.take())
    }

    pub(crate) fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }
}
