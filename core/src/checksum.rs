//! The CRC-32 (ISO-HDLC) of recipes, compact bases, link frames and saved readings.
//!
//! It is implemented here because parsing a recipe is mostly this computation. Existing crates take twice as many
//! instructions with a table of 1 kB, or have tables of 16 kB. Tests compare it with the crate `crc`.

/// The remainder of each byte value, for the reflected polynomial 0x04c11db7.
static TABLE: [u32; 256] = table();

const fn table() -> [u32; 256] {
    let mut table = [0; 256];
    let mut rest: &mut [u32] = &mut table;
    let mut byte = 0;
    while let [entry, after @ ..] = rest {
        let mut remainder: u32 = byte;
        let mut bit = 0_u32;
        while bit < 8 {
            remainder = (remainder >> 1) ^ ((remainder & 1).wrapping_neg() & 0xedb8_8320);
            bit = bit.wrapping_add(1);
        }
        *entry = remainder;
        byte = byte.wrapping_add(1);
        rest = after;
    }
    table
}

/// Returns the CRC-32 (ISO-HDLC) of bytes.
#[must_use]
pub fn crc_32(bytes: &[u8]) -> u32 {
    !update(u32::MAX, bytes)
}

/// Returns the checksum of a recipe or a compact basis.
///
/// It is the CRC-32 (ISO-HDLC) of version and length, both in little endian, and the body after them.
#[must_use]
pub fn crc_32_of_file(version: u16, length: u32, body: &[u8]) -> u32 {
    let ([a, b], [c, d, e, f]) = (version.to_le_bytes(), length.to_le_bytes());
    !update(update(u32::MAX, &[a, b, c, d, e, f]), body)
}

/// Updates the remainder with bytes, four at a time. Loads and shifts of single bytes would take twice as long.
#[inline(never)]
fn update(state: u32, bytes: &[u8]) -> u32 {
    let (words, rest) = bytes.as_chunks();
    let mut state = state;
    for word in words {
        state ^= u32::from_le_bytes(*word);
        state = step(step(step(step(state))));
    }
    for byte in rest {
        state = step(state ^ u32::from(*byte));
    }
    state
}

/// Divides out the lowest byte of the state.
#[inline(always)]
fn step(state: u32) -> u32 {
    let [low, ..] = state.to_le_bytes();
    let remainder = TABLE.get(usize::from(low)).copied().unwrap_or_default();
    (state >> 8) ^ remainder
}
