//! Counts of the arms' steps as words for memory that a reset leaves alone: so that the next visit
//! home tells whether they were right.

use crate::station::ARMS;

/// Words that they take.
pub const WORDS: usize = ARMS + 1;

/// The counts, and a word by which they are known again; `None` is as nothing.
pub fn words(positions: Option<[i32; ARMS]>) -> [u32; WORDS] {
    let Some([a, b, c, d]) = positions else {
        return [0; WORDS];
    };
    let [a, b, c, d] = [a, b, c, d].map(i32::cast_unsigned);
    [a, b, c, d, check([a, b, c, d])]
}

/// The counts, if these words are such.
pub fn positions([a, b, c, d, found]: [u32; WORDS]) -> Option<[i32; ARMS]> {
    (check([a, b, c, d]) == found).then(|| [a, b, c, d].map(u32::cast_signed))
}

fn check(words: [u32; ARMS]) -> u32 {
    // FNV's prime, so that no word of zeros or of a pattern passes.
    words.iter().fold(0x5CA4_4E25, |sum: u32, word| {
        (sum ^ word).wrapping_mul(0x0100_0193).rotate_left(7)
    })
}
