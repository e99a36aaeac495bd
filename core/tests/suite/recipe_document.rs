//! The format that is written and read equals that of `core/docs/recipe.md`.

use glimpse_core::gonio::Limits;
use glimpse_core::recipe::{
    Effort, ExpectedLoss, HEADER_BYTES, Kind, Noise, Origin, PackedMethod, PackedRidge, Parts,
    Provenance, RecipeParts, Schedule, Training, TrainingSource, TrainingSources, VERSION,
    ValidationSplit,
};
use serde::de::DeserializeOwned;

use crate::documents::hex_bytes;
use crate::recipes::{packed, write};

const DOCUMENT: &str = include_str!("../../docs/recipe.md");

const SOURCES: [TrainingSource<'_>; 1] = [TrainingSource {
    label: "MERL",
    origin: Origin::Files,
    materials: 100,
    share: 1.0,
}];
const TRAINING: Training<'_> = Training {
    schedule: Schedule::Joint,
    effort: Effort::Standard,
    parts: Parts::All,
    split: ValidationSplit::LeftOut,
    digest: 300,
    sources: TrainingSources::new(&SOURCES),
};

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
        limits: Some(Limits {
            max_theta_i: 1.25,
            max_theta_o: 1.5,
            min_separation: 0.125,
            in_plane: false,
        }),
        noise: Some(Noise {
            multiplicative: 0.03125,
            additive: 0.0,
            levels: 4096,
        }),
        expectation: Some(ExpectedLoss {
            loss: 0.0625,
            standard_error: Some(0.0078125),
            materials: 10,
            on: "held out",
        }),
        provenance: Some(Provenance {
            trainer: "trainer 1",
            data: "MERL",
            materials: 100,
            schedule: "joint",
            seed: 300,
            options: "",
        }),
        materials: &[("brass", 0xcbf4_3926), ("felt", 5)],
        training: Some(TRAINING),
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

/// The numbers and names of all variants of a field of training.
fn variants<T: DeserializeOwned>(name: fn(T) -> &'static str) -> String {
    let variants = (0..).map_while(|number: u8| {
        let variant = postcard::from_bytes(&[number]).ok()?;
        Some(format!("{number} {}", name(variant)))
    });
    variants.collect::<Vec<_>>().join(", ")
}

#[test]
fn document_lists_training_variants() {
    let section = section(Kind::TRAINING);
    for (field, variants) in [
        ("schedule", variants(Schedule::name)),
        ("effort", variants(Effort::name)),
        ("parts", variants(Parts::name)),
        ("split", variants(ValidationSplit::name)),
        ("origin", variants(Origin::name)),
    ] {
        let row = format!("\n| {field} | varint | {variants} |");
        assert!(section.contains(&row), "{row}");
    }
}
