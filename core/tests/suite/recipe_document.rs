//! `docs/recipe.md` and `docs/recipe.hex` match the format. With `GLIMPSE_BLESS=1`, the lists in the document are
//! written again.

use glimpse_core::recipe::METADATA;
use glimpse_core::section::{Count, Field};

use crate::documents::hex_bytes;
use crate::recipe::fields_of;
use crate::recipes::{Contents, Pattern, Ridge, Rows, VERSION};

const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/recipe.md");

fn number(x: f32) -> String {
    match x.abs() {
        1e-3..1e4 | 0.0 => x.to_string(),
        _ => format!("{x:e}"),
    }
}

fn range(field: &Field) -> String {
    match (field.encoding, field.range) {
        ("0 or 1" | "bytes", _) | (_, (f32::MIN, f32::MAX)) => String::new(),
        (_, (f32::MIN_POSITIVE, f32::MAX)) => "above 0".into(),
        (_, (f32::MIN_POSITIVE, max)) => format!("above 0, to {}", number(max)),
        (_, (0.0, f32::MAX)) => "not negative".into(),
        (_, (min, max)) => format!("{} to {}", number(min), number(max)),
    }
}

/// The item of a field: `name`: type of length, range: content.
fn item(field: &Field) -> String {
    let symbols = field.length.iter().map(|count| count.bounds().0);
    let length = symbols.collect::<Vec<_>>().join(" ");
    let (_, name) = field.name.split_once('.').unwrap();
    let lines = field.text.iter().map(|line| line.trim());
    let text = lines.collect::<Vec<_>>().join(" ");
    let mut item = format!("- `{name}`, {}", field.encoding);
    if !length.is_empty() {
        item += &format!(" of {length}");
    }
    if field.optional {
        item += " or 0";
    }
    match range(field) {
        range if range.is_empty() => {}
        range => item += &format!(", {range}"),
    }
    format!("{item}: {text}\n")
}

/// The generated lists: their names, and their text.
fn lists() -> Vec<(String, String)> {
    let mut lists: Vec<_> = (0..METADATA)
        .filter_map(|kind| {
            let (name, fields) = fields_of(kind);
            let items = fields.iter().map(item).collect::<String>();
            (!fields.is_empty()).then(|| (format!("fields of {name}"), items))
        })
        .collect();
    let counts = [
        Count::Samples,
        Count::Components,
        Count::Coefficients,
        Count::Hidden,
        Count::Rows,
        Count::Units,
        Count::VirtualReadings,
    ];
    let ranges = counts.map(|count| {
        let (symbol, range) = count.bounds();
        format!("{symbol} {} to {}", range.start(), range.end())
    });
    lists.push(("counts".into(), format!("Ranges: {}.\n", ranges.join(", "))));
    lists
}

#[test]
fn document_matches_sections() {
    let document = std::fs::read_to_string(PATH).unwrap();
    let mut updated = document.clone();
    for (name, list) in lists() {
        let begin = format!("<!-- {name} -->\n");
        let (before, rest) = updated.split_once(&begin).expect(&name);
        let (_, after) = rest.split_once("<!-- end of list -->").expect(&name);
        updated = format!("{before}{begin}\n{list}\n<!-- end of list -->{after}");
    }
    if std::env::var_os("GLIMPSE_BLESS").is_some() {
        std::fs::write(PATH, &updated).unwrap();
    }
    assert!(
        document == updated,
        "the lists differ: run this test with GLIMPSE_BLESS=1"
    );
    for kind in 0..METADATA {
        let (name, fields) = fields_of(kind);
        assert!(fields.is_empty() || document.contains(&format!("\n### {kind}, {name}\n")));
    }
    assert!(document.starts_with(&format!("# The recipe, format {VERSION}\n")));
}

#[test]
fn example_bytes_match_writer() {
    let example = Contents {
        pattern: Pattern {
            directions: vec![0.25, 0.5, 1.0],
            is_path: false,
            expected_loss: Some(0.0625),
        },
        ridge: Some(Ridge {
            precision: vec![40.0, 4.0],
            difference_precision: Vec::new(),
            center: vec![4.5],
            rows: Rows::floats(&[1.5, -2.0]),
            basis_checksum: 0x0123_abcd,
        }),
        metadata: Some(b"felt".to_vec()),
        ..Contents::default()
    };
    let expected = example.write();
    let actual = hex_bytes(include_str!("../../docs/recipe.hex"));
    assert_eq!(actual, expected, "the bytes are {expected:02x?}");
}
