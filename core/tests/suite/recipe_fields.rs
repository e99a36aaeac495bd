//! Each field of a recipe, as `core/docs/recipe.md` documents it, is invalidated in every way. The error names the field.

use std::f32::consts::PI;
use std::ops::Range;

use glimpse_core::recipe::{Field, Kind, Recipe, RecipeError};

use crate::completion::partial::all_small;
use crate::recipe_document::section;
use crate::recipe_sections::full_sections;
use crate::recipes::{Sections, linear, packed, recipe_with, sections_of};

/// A row of a section's table.
struct Row {
    name: &'static str,
    encoding: &'static str,
    bounds: &'static str,
}

/// The documented fields of a section, in order.
fn rows(kind: Kind) -> Vec<Row> {
    let lines = section(kind).lines();
    let lines = lines.filter(|line| line.starts_with("| ") && !line.starts_with("| field"));
    let rows = lines.map(|line| {
        let mut cells = line.split('|').map(str::trim).skip(1);
        let mut next = || cells.next().unwrap();
        let [name, encoding, _content, bounds] = [next(), next(), next(), next()];
        Row {
            name,
            encoding,
            bounds,
        }
    });
    rows.collect()
}

/// The varint at the beginning of some bytes, and its length.
fn varint(bytes: &[u8]) -> (usize, usize) {
    let (value, rest) = postcard::take_from_bytes::<u64>(bytes).unwrap();
    (value as usize, bytes.len() - rest.len())
}

/// The bytes of each field of a section.
fn fields(kind: Kind, bytes: &[u8]) -> Vec<(Row, Range<usize>)> {
    let mut start = 0;
    let fields = rows(kind).into_iter().map(|row| {
        let rest = &bytes[start..];
        let length = match row.encoding {
            "f32" => 4,
            "4 f32" => 16,
            "0, or 1 and f32" => 1 + 4 * usize::from(rest[0]),
            "list" | "weights" | "text" => {
                let (count, prefix) = varint(rest);
                prefix + count
            }
            _ => varint(rest).1,
        };
        let span = start..start + length;
        start = span.end;
        (row, span)
    });
    fields.collect()
}

/// Bytes with their length before them.
fn with_length(bytes: &[u8]) -> Vec<u8> {
    [with_varint(bytes.len()), bytes.to_vec()].concat()
}

fn with_varint(value: usize) -> Vec<u8> {
    let mut buffer = [0; 10];
    postcard::to_slice(&(value as u64), &mut buffer)
        .unwrap()
        .to_vec()
}

/// Documented ranges of a field: of its count, and of its numbers.
#[derive(Clone, Copy, Debug, Default)]
struct Bounds {
    count: Option<[usize; 2]>,
    min: Option<f32>,
    max: Option<f32>,
    is_positive: bool,
}

impl Bounds {
    fn new(row: &Row) -> Self {
        // The small recipes of completions have m = 4 and m + h = 9.
        let text = row.bounds.replace("m + h", "9").replace("m to", "4 to");
        let mut bounds = Self {
            is_positive: text.starts_with("above 0"),
            min: text.starts_with("not negative").then_some(0.0),
            ..Self::default()
        };
        let words: Vec<&str> = text
            .split([' ', ','])
            .filter(|word| !word.is_empty())
            .collect();
        for (index, _) in words.iter().enumerate().filter(|(_, word)| **word == "to") {
            let [min, max] = [words[index - 1], words[index + 1]];
            let unit = words.get(index + 2);
            if row.encoding == "varint" || unit.is_some_and(|unit| ["of", "samples"].contains(unit))
            {
                bounds.count = Some([min, max].map(|word| word.parse().unwrap()));
            } else {
                (bounds.min, bounds.max) = (min.parse().ok(), max.parse().ok());
            }
        }
        bounds.is_positive |= bounds.min.is_some_and(|min| min > 0.0);
        if row.is_angles() {
            (bounds.min, bounds.max) = (Some(-1000.0), Some(1000.0));
        }
        bounds
    }
}

impl Row {
    /// Returns true for a list of directions.
    fn is_angles(&self) -> bool {
        ["pattern", "directions"].contains(&self.name)
    }

    /// The field that errors name.
    fn field(&self, kind: Kind) -> Option<Field> {
        let name = self.name;
        let full_name = format!("{}.{name}", kind.name().unwrap());
        let named = |name: &str| all_fields().find(|field| field.name() == name);
        named(&full_name).or_else(|| named(name))
    }
}

/// All fields that errors name.
fn all_fields() -> impl Iterator<Item = Field> {
    (0..).map_while(|number: u8| postcard::from_bytes(&[number]).ok())
}

/// An expected result, and a number that has it.
type Outcome = Result<(), RecipeError>;

/// Numbers around the bounds of a field, with the results of reading them.
fn numbers(row: &Row, field: Field) -> Vec<(f32, Outcome)> {
    let Bounds {
        min,
        max,
        is_positive,
        ..
    } = Bounds::new(row);
    let mut numbers = vec![];
    for number in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        numbers.push((number, Err(RecipeError::NonFinite(field))));
    }
    if is_positive {
        for number in [0.0, -0.0, -1.0] {
            numbers.push((number, Err(RecipeError::NotPositive(field))));
        }
    }
    let below = match min {
        Some(0.0) => RecipeError::Negative(field),
        _ => RecipeError::Range(field),
    };
    if let Some(min) = min.filter(|min| !is_positive || *min > 0.0) {
        numbers.extend([(min, Ok(())), (min.next_down(), Err(below))]);
    }
    if let Some(max) = max {
        numbers.push((max, Ok(())));
        for number in [max.next_up(), f32::MAX] {
            numbers.push((number, Err(RecipeError::Range(field))));
        }
    }
    // Within the range, directions may be below the horizon.
    numbers.retain(|(_, outcome)| outcome.is_err() || !row.is_angles());
    numbers
}

/// Contents of a list of the wrong length, and of the longest valid one.
fn lists(row: &Row, list: &[u8]) -> (Vec<Vec<u8>>, Option<Vec<u8>>) {
    let entry = match row.encoding {
        "weights" => 1,
        _ if row.is_angles() => 12,
        _ => 4,
    };
    let first = &list[..entry];
    let mut wrong = vec![vec![], [list, &[0]].concat(), list[1..].to_vec()];
    let Some([min, max]) = Bounds::new(row).count else {
        wrong.extend([list[entry..].to_vec(), [list, first].concat()]);
        return (wrong, None);
    };
    wrong.extend([min - 1, max + 1].map(|count| first.repeat(count)));
    (wrong, Some(first.repeat(max)))
}

/// Replacements of a field's bytes, with the results of reading them.
fn replacements(kind: Kind, row: &Row, bytes: &[u8]) -> Vec<(Vec<u8>, Outcome)> {
    let Some(field) = row.field(kind) else {
        let invalid = match (row.encoding, bytes) {
            ("text", [_, _, rest @ ..]) => [&[bytes[0], 0xFF], rest].concat(),
            ("0 or 1", _) => vec![2],
            _ if row.name == "model" => vec![99],
            _ => return vec![],
        };
        return vec![(invalid, Err(RecipeError::Section(kind)))];
    };
    let count = Err(RecipeError::Count(field));
    let mut replacements = vec![];
    match row.encoding {
        "list" | "weights" => {
            let list = &bytes[varint(bytes).1..];
            if list.is_empty() {
                let unused = Err(RecipeError::Unused(field));
                return vec![(with_length(&[0; 4]), unused)];
            }
            let (wrong, longest) = lists(row, list);
            replacements.extend(wrong.iter().map(|list| (with_length(list), count)));
            replacements.extend(longest.map(|list| (with_length(&list), Ok(()))));
            for phi_d in [0.0, PI].into_iter().filter(|_| row.is_angles()) {
                // One direction is below the horizon: that of the light, or that of the sensor.
                let last = list.len() - 12;
                let below = [&list[..last], &packed(&[1.2, 1.2, phi_d])].concat();
                let error = match field {
                    Field::Pattern => RecipeError::BelowHorizon((last / 12) as u16),
                    _ => RecipeError::Range(field),
                };
                replacements.push((with_length(&below), Err(error)));
            }
            if row.encoding == "list" {
                for (number, outcome) in numbers(row, field) {
                    for index in [0, list.len() / 4 - 1] {
                        let mut list = list.to_vec();
                        list[4 * index..][..4].copy_from_slice(&number.to_le_bytes());
                        replacements.push((with_length(&list), outcome));
                    }
                }
            }
        }
        "f32" | "4 f32" | "0, or 1 and f32" => {
            for (number, outcome) in numbers(row, field) {
                for index in 0..bytes.len() / 4 {
                    let mut bytes = bytes.to_vec();
                    let start = bytes.len() % 4 + 4 * index;
                    bytes[start..][..4].copy_from_slice(&number.to_le_bytes());
                    replacements.push((bytes, outcome));
                }
            }
        }
        "0, 1 or 2" => replacements.push((vec![3], Err(RecipeError::Range(field)))),
        _ => {
            if let Some([min, max]) = Bounds::new(row).count {
                replacements.extend([min - 1, max + 1].map(|value| (with_varint(value), count)));
                replacements.extend([min, max].map(|value| (with_varint(value), Ok(()))));
            } else if row.bounds == "0 with a start" && bytes == [0] {
                replacements.push((vec![1], Err(RecipeError::Unused(field))));
            }
        }
    }
    replacements
}

/// Invalidates each field of each section. Returns the fields that an error named.
fn check_recipe(sections: &Sections) -> Vec<Field> {
    let mut named = vec![];
    for (index, (kind, bytes)) in sections.iter().enumerate() {
        if [Kind::EXPECTATION, Kind::PATH_ORDER, Kind::METADATA].contains(kind) {
            continue; // a fit needs none of them
        }
        let fields = fields(*kind, bytes);
        let end = fields.last().unwrap().1.end;
        assert_eq!(end, bytes.len(), "section {kind}");
        for (row, span) in fields {
            for (replacement, expected) in replacements(*kind, &row, &bytes[span.clone()]) {
                let mut changed = sections.clone();
                changed[index].1.splice(span.clone(), replacement);
                let bytes = recipe_with(&changed);
                let actual = Recipe::parse(&bytes);
                let field = row.field(*kind);
                match (expected, actual.map(drop)) {
                    // Another number of entries may contradict another field.
                    (Ok(()), Err(RecipeError::Count(other))) if Some(other) != field => {}
                    (_, actual) => assert_eq!(actual, expected, "{kind}, {}", row.name),
                }
                named.extend(field);
            }
        }
    }
    named
}

#[test]
fn every_field_is_checked() {
    let mut named = check_recipe(&full_sections());
    named.extend(check_recipe(&sections_of(&linear().write().unwrap())));
    for contents in all_small() {
        named.extend(check_recipe(&sections_of(&contents.write())));
    }
    let mut unnamed = all_fields().filter(|field| !named.contains(field));
    assert!(unnamed.all(|field| [Field::Body, Field::ExpectedLoss].contains(&field)));
}
