//! Numbers in cells, as people and programs write them.

use super::names::simplified;

/// Words for a missing number, in letters and digits.
const MISSING: [&str; 5] = ["na", "nan", "null", "none", "missing"];
/// Characters that may separate thousands, in addition to commas and points.
const SEPARATORS: [char; 7] = [
    ' ', '\u{a0}', '\u{2009}', '\u{202f}', '\u{2007}', '\'', '\u{2019}',
];

/// The marks of decimals, each with the separator of thousands.
pub(super) const MARKS: [(char, char); 2] = [('.', ','), (',', '.')];

/// Returns a number with ASCII characters, without a degree sign and without spaces or apostrophes between thousands; empty if
/// it is missing.
pub(super) fn plain(cell: &str) -> String {
    let is_missing = MISSING.contains(&&simplified(cell)[..]) && !cell.starts_with('#');
    let characters = cell.chars().map(|c| match c {
        '\u{2212}' | '\u{2013}' | '\u{2014}' | '\u{fe63}' | '\u{ff0d}' => '-',
        '\u{ff01}'..='\u{ff5e}' => char::from_u32(c as u32 - 0xfee0).unwrap_or(c),
        other => other,
    });
    let text: String = characters.collect();
    let text = text.trim_end_matches(['°', 'º']).trim();
    if is_missing || ["-", "--"].contains(&text) {
        return String::new();
    }
    // Each group but the first begins with three digits, and only the last one has more.
    let mut groups = text.split(SEPARATORS);
    let first = groups
        .next()
        .unwrap_or_default()
        .trim_start_matches(['+', '-']);
    let is_group = |group: &str| {
        group
            .split(['.', ','])
            .next()
            .is_some_and(|whole| whole.len() == 3 && is_digits(whole))
    };
    if first.is_empty() || is_digits(first) && groups.all(is_group) {
        text.replace(SEPARATORS, "")
    } else {
        text.to_owned()
    }
}

fn is_digits(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|c| c.is_ascii_digit())
}

/// Returns a plain number with a decimal point and without separators of thousands; None if the mark is not that of the
/// number.
pub(super) fn with_point(number: &str, (decimal, thousands): (char, char)) -> Option<String> {
    let (mantissa, exponent) = number.split_at(number.find(['e', 'E']).unwrap_or(number.len()));
    let (whole, decimals) = mantissa.split_once(decimal).unwrap_or((mantissa, ""));
    let groups: Vec<&str> = whole
        .trim_start_matches(['+', '-'])
        .split(thousands)
        .collect();
    let first = groups[0];
    let is_group = |group: &&str| group.len() == 3 && is_digits(group);
    let is_valid = groups.len() == 1
        || (1..=3).contains(&first.len())
            && is_digits(first)
            && !first.starts_with('0')
            && groups[1..].iter().all(is_group);
    let point = if mantissa.contains(decimal) { "." } else { "" };
    let number = format!(
        "{}{point}{decimals}{exponent}",
        whole.replace(thousands, "")
    );
    (is_valid && number.parse::<f64>().is_ok()).then_some(number)
}

/// Decodes text in Windows-1252; None if a byte is not printable.
pub(super) fn decode_latin(bytes: &[u8]) -> Option<String> {
    const HIGH: &str = "€?‚ƒ„…†‡ˆ‰Š‹Œ?Ž??‘’“”•–—˜™š›œ?žŸ";
    let characters = bytes.iter().map(|byte| match byte {
        b'\t' | b'\r' | b'\n' | b' '..=b'~' | 0xa0.. => Some(char::from(*byte)),
        0x80..=0x9f => HIGH
            .chars()
            .nth(usize::from(*byte - 0x80))
            .filter(|c| *c != '?'),
        _ => None,
    });
    characters.collect()
}
