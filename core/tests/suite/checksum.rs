//! The CRC-32 equals that of the crate `crc`.

use crc::{CRC_32_ISO_HDLC, Crc};
use glimpse_core::checksum::{crc_32, crc_32_of_file};
use proptest::prelude::*;

proptest! {
    #[test]
    fn matches_crate_crc(
        bytes in prop::collection::vec(any::<u8>(), 0..70),
        version: u16,
        length: u32,
    ) {
        let reference = Crc::<u32>::new(&CRC_32_ISO_HDLC);
        prop_assert_eq!(crc_32(&bytes), reference.checksum(&bytes));
        let [head, tail] = [version.to_le_bytes().to_vec(), length.to_le_bytes().to_vec()];
        let all = [head, tail, bytes.clone()].concat();
        prop_assert_eq!(crc_32_of_file(version, length, &bytes), reference.checksum(&all));
    }
}
