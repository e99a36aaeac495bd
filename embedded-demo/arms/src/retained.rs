//! Encoding of the arms' step counts for memory that survives a reset. The next homing checks the counts.

use crate::station::ARMS;

/// Number of encoded words.
pub const WORDS: usize = ARMS + 1;

/// Encodes the counts, with a check word. Unknown counts are encoded as zeros, which [`decode`] rejects.
pub fn encode(positions: Option<[i32; ARMS]>) -> [u32; WORDS] {
    let Some([a, b, c, d]) = positions else {
        return [0; WORDS];
    };
    let [a, b, c, d] = [a, b, c, d].map(i32::cast_unsigned);
    [a, b, c, d, check([a, b, c, d])]
}

/// Decodes the counts. Returns None if the check word is wrong.
pub fn decode([a, b, c, d, check_word]: [u32; WORDS]) -> Option<[i32; ARMS]> {
    (check([a, b, c, d]) == check_word).then(|| [a, b, c, d].map(u32::cast_signed))
}

fn check(words: [u32; ARMS]) -> u32 {
    // FNV's prime: neither zeros nor a repeated pattern pass the check.
    words.iter().fold(0x5CA4_4E25, |sum: u32, word| {
        (sum ^ word).wrapping_mul(0x0100_0193).rotate_left(7)
    })
}
