//! A recipe from bytes that nobody vouches for: it is refused, or all that it promises holds.
//!
//! Random bytes never have the right checksum, so one input in two has it put right first.

#![no_main]

use glimpse_core::fit::Workspace;
use glimpse_core::model::{CookTorrance, Model, Neural, Phong};
use glimpse_core::recipe::{HEADER_BYTES, Learner, Recipe};
use glimpse_core::scan::{LinearScan, Measurement, Scan};
use libfuzzer_sys::fuzz_target;

const MEASUREMENT: Measurement = Measurement {
    brdf: [0.4, 0.3, 0.2],
    saturated: false,
};

fuzz_target!(|bytes: &[u8]| {
    let Some((mend, bytes)) = bytes.split_first() else {
        return;
    };
    let mut bytes = bytes.to_vec();
    if mend & 1 == 1 && bytes.len() >= HEADER_BYTES {
        let length = (bytes.len() - HEADER_BYTES) as u32;
        bytes[6..10].copy_from_slice(&length.to_le_bytes());
        let covered = [&bytes[4..10], &bytes[HEADER_BYTES..]].concat();
        let checksum = crc32(&covered);
        bytes[10..14].copy_from_slice(&checksum.to_le_bytes());
    }
    let Ok(recipe) = Recipe::parse(&bytes) else {
        return;
    };
    assert_eq!(recipe.pattern().count(), recipe.samples());
    match recipe.learner() {
        Learner::Descent(_) => {
            descend::<Phong>(recipe);
            descend::<CookTorrance>(recipe);
            descend::<Neural>(recipe);
        }
        Learner::Ridge(ridge) => {
            let length = LinearScan::<64>::memory_length(recipe.samples(), ridge.components());
            let mut memory = vec![0.0; length];
            let mut begun = LinearScan::<64>::new(recipe, &mut memory);
            if let Ok(scan) = &mut begun {
                while scan.next_directions().is_some() && scan.record(MEASUREMENT).is_ok() {}
                assert!(scan.advance_fit(3).is_complete());
                let _ = scan.residual();
            }
        }
    }
});

fn descend<M: Model>(recipe: Recipe<'_>) {
    let mut workspace = Workspace::<M>::new();
    if let Ok(mut scan) = Scan::<M, 64>::new(recipe, &mut workspace) {
        while scan.next_directions().is_some() && scan.record(MEASUREMENT).is_ok() {}
        let _ = scan.advance_fit(64);
        let _ = scan.residual();
    }
}

/// CRC-32/ISO-HDLC, of version, length and body, as the format says.
fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = !0_u32;
    for byte in bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ (0xEDB8_8320 & (crc & 1).wrapping_neg());
        }
    }
    !crc
}
