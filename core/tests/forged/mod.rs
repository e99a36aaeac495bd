//! Recipes that nobody would write, with a header that is right.

/// A recipe of any version and body, with a header that is right.
pub(crate) fn sealed(version: u16, body: &[u8]) -> Vec<u8> {
    let mut checked = version.to_le_bytes().to_vec();
    checked.extend((body.len() as u32).to_le_bytes());
    let header = [b"GLMP", &checked[..]].concat();
    checked.extend(body);
    let checksum = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&checked);
    [&header[..], &checksum.to_le_bytes(), body].concat()
}
