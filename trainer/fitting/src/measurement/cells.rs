//! Text and numbers as people and programs write them.

use glimpse_materials::untrusted::escaped_start;

use super::columns::simplified;

/// Words for a missing number, in letters and digits.
const MISSING: [&str; 5] = ["na", "nan", "null", "none", "missing"];
/// Characters that may separate thousands, in addition to commas and points.
const SEPARATORS: [char; 7] = [
    ' ', '\u{a0}', '\u{2009}', '\u{202f}', '\u{2007}', '\'', '\u{2019}',
];

/// The marks of decimals, each with the separator of thousands.
pub(super) const MARKS: [(char, char); 2] = [('.', ','), (',', '.')];

/// Returns a number with ASCII characters and without a degree sign; empty if it is missing.
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
    text.to_owned()
}

/// Returns a plain number with a decimal point and without separators of thousands; None if the marks are not those of the
/// number.
pub(super) fn with_point(number: &str, (decimal, thousands): (char, char)) -> Option<String> {
    let (whole, decimals) = number.split_at(number.find(decimal).unwrap_or(number.len()));
    let is_separator = |c: char| c == thousands || SEPARATORS.contains(&c);
    let digits = whole.trim_start_matches(['+', '-']);
    let mut groups = digits.split(is_separator);
    let first = groups.next().unwrap_or_default();
    let is_group = |group: &str| group.len() == 3 && group.bytes().all(|c| c.is_ascii_digit());
    let has_groups = first.len() <= 3 && !first.starts_with('0') && groups.all(is_group);
    let number = whole.replace(is_separator, "") + &decimals.replace(decimal, ".");
    let is_valid = (first == digits || has_groups) && number.parse::<f64>().is_ok();
    is_valid.then_some(number)
}

/// Returns the text of a file, in UTF-8 or Windows-1252, with `\n` at the end of each line. Spreadsheets and other files that
/// are not text have bytes that are 0 or not printable.
pub(super) fn decode(bytes: &[u8]) -> Result<String, String> {
    let text = str::from_utf8(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes));
    let text = match text {
        Ok(text) => Some(text.to_owned()).filter(|text| !text.contains('\0')),
        Err(_) => decode_latin(bytes),
    };
    let text = text.map(|text| text.replace("\r\n", "\n").replace('\r', "\n"));
    text.ok_or_else(|| {
        let start = escaped_start(bytes);
        format!("it is not text, and starts with `{start}`; save it as CSV in UTF-8")
    })
}

/// Decodes text in Windows-1252, as far as numbers and units need it; None if a byte is not printable.
fn decode_latin(bytes: &[u8]) -> Option<String> {
    let characters = bytes.iter().map(|byte| match byte {
        b'\t' | b'\r' | b'\n' | b' '..=b'~' | 0xa0.. => Some(char::from(*byte)),
        0x96 => Some('–'),
        0x80..=0x9f => Some(char::REPLACEMENT_CHARACTER),
        _ => None,
    });
    characters.collect()
}
