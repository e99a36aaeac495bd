//! The format that is written and read equals that of `core/docs/recipe.md`.

use glimpse_core::recipe::{HEADER_BYTES, Kind, PackedMethod, PackedRidge, RecipeParts, VERSION};

use crate::documents::hex_bytes;
use crate::recipes::{packed, write};

const DOCUMENT: &str = include_str!("../../docs/recipe.md");

/// The document's example recipe.
fn example() -> Vec<u8> {
    let pattern = packed(&[0.25, 0.5, 1.0]);
    let (basis, precision) = (packed(&[1.5, -2.0]), packed(&[40.0, 4.0]));
    let [mean, median, weight] = [-0.5, 0.25, 0.75].map(f32::to_le_bytes);
    let method = PackedMethod::Ridge(PackedRidge {
        components: 2,
        basis: &basis,
        mean: &mean,
        median: &median,
        weight: &weight,
        precision: &precision,
        basis_checksum: 0x0123_abcd,
    });
    let parts = RecipeParts {
        expected_loss: Some(0.0625),
        metadata: &[1, 2, 3],
        ..RecipeParts::new(&pattern, method)
    };
    write(&parts).unwrap()
}

#[test]
fn written_bytes_match_document() {
    let actual = hex_bytes(include_str!("../../docs/recipe.hex"));
    let expected = example();
    assert_eq!(actual, expected, "the bytes are {expected:02x?}");
}

/// The row of a table that begins with these cells.
fn row(cells: &[&str]) -> &'static str {
    let beginning = format!("| {} |", cells.join(" | "));
    let mut rows = DOCUMENT.lines().filter(|line| line.starts_with(&beginning));
    rows.next()
        .unwrap_or_else(|| panic!("the document lacks a row {beginning}"))
}

#[test]
fn document_lists_kinds() {
    for number in 0..=u16::MAX {
        let kind = Kind::new(number);
        if let Some(name) = kind.name() {
            let needed = row(&[&number.to_string(), name]).contains("required");
            assert_eq!(needed, kind.is_required(), "{kind}");
        }
    }
    assert!(DOCUMENT.contains(&format!("format {VERSION}")));
    row(&[&format!("{HEADER_BYTES}..")]);
}

/// The document's section of a kind.
pub(crate) fn section(kind: Kind) -> &'static str {
    let name = kind.name().unwrap();
    let heading = format!("\n### {}, {name}\n", kind.number());
    let (_, section) = DOCUMENT.split_once(&heading).unwrap();
    section.split("\n##").next().unwrap()
}
