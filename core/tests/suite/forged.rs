//! Forged recipes with a valid checksum: they are rejected, or a scan ends with finite numbers or a reported error.
//!
//! `GLIMPSE_FORGED=100000` tests more of them.

use glimpse_core::recipe::Recipe;
use glimpse_core_fuzz::recipe::check;

use crate::random::Random;
use crate::recipe::fields;
use crate::recipes::{Contents, combinations};

/// Number of forged recipes without an environment variable.
const FORGED: usize = 20_000;

/// A number of any magnitude, at or near a bound, or not finite.
fn any_number(random: &mut Random, (min, max): (f32, f32)) -> f32 {
    match random.bits() % 16 {
        0 => min,
        1 => max,
        2 => 0.0,
        3 => f32::from_bits(random.bits() as u32),
        4 => random.number(),
        // Any exponent within the range.
        _ => {
            let size = f32::from_bits(random.bits() as u32 >> 1).min(max.min(f32::MAX));
            (if random.bits() & 1 == 1 { size } else { -size }).max(min)
        }
    }
}

/// Replaces some numbers of a field.
fn forge_field(random: &mut Random, encoding: &str, range: (f32, f32), bytes: &mut [u8]) {
    let length = bytes.len();
    if !matches!(encoding, "f32" | "list" | "rows" | "0, or 1 and f32") || length < 4 {
        if let Some(last) = bytes.last_mut().filter(|_| encoding != "0 or 1") {
            *last = random.bits() as u8 & 0x7F;
        }
        return;
    }
    let count = length / 4;
    let all = random.bits().is_multiple_of(3);
    let number = any_number(random, range);
    for index in 0..count {
        if all || random.bits().is_multiple_of(count as u64) {
            let number = if random.bits() & 1 == 1 {
                number
            } else {
                any_number(random, range)
            };
            let end = length - 4 * index;
            bytes[end - 4..end].copy_from_slice(&number.to_le_bytes());
        }
    }
}

/// A recipe of two valid ones: sections of either, with damaged fields and bytes.
fn forge(random: &mut Random, all: &[Contents]) -> Vec<u8> {
    let mut contents = all[random.bits() as usize % all.len()].clone();
    let other = all[random.bits() as usize % all.len()].clone();
    let mut sections = contents.sections();
    match random.bits() % 8 {
        0 => contents.pattern = other.pattern,
        1 => contents.ridge = other.ridge,
        2 => contents.net = other.net,
        3 => (contents.start, contents.gauss_newton) = (other.start, other.gauss_newton),
        4 => contents.prediction = other.prediction,
        5 => {
            // A random byte, which may be a length.
            let at = random.bits() as usize % sections.len();
            let bytes = &mut sections[at].1;
            let at = random.bits() as usize % bytes.len();
            bytes[at] = random.bits() as u8;
            return contents.write_with(&sections);
        }
        _ => {}
    }
    sections = contents.sections();
    let original = sections.clone();
    for _ in 0..random.bits() % 4 {
        let at = random.bits() as usize % sections.len();
        let (kind, bytes) = &original[at];
        let fields = fields(*kind, bytes);
        let (field, span) = &fields[random.bits() as usize % fields.len()];
        // Without the length. Of rows, the last half: some of the entries, and all scales.
        let start = match field.encoding {
            "list" | "bytes" => postcard::take_from_bytes::<u64>(&bytes[span.clone()])
                .map_or(span.start, |(_, rest)| span.end - rest.len()),
            "rows" => (span.start + span.end) / 2,
            _ => span.start,
        };
        let bytes = &mut sections[at].1[start..span.end];
        forge_field(random, field.encoding, field.range, bytes);
    }
    contents.write_with(&sections)
}

#[test]
fn forged_recipe_is_rejected_or_scans() {
    let count = std::env::var("GLIMPSE_FORGED").map_or(FORGED, |count| count.parse().unwrap());
    let all = combinations()
        .into_iter()
        .flat_map(|(_, contents)| match contents.ridge {
            Some(_) => vec![contents.clone(), contents.predicted()],
            None => vec![contents],
        });
    let all: Vec<_> = all.collect();
    let mut accepted = 0;
    for seed in 0..count as u64 {
        let bytes = forge(&mut Random(seed), &all);
        accepted += usize::from(Recipe::parse(&bytes).is_ok());
        let is_checked = std::panic::catch_unwind(|| check(&[&[0], &bytes[..]].concat()));
        assert!(is_checked.is_ok(), "forged recipe {seed}");
    }
    assert!(
        (count / 50..count - count / 50).contains(&accepted),
        "{accepted}"
    );
}
