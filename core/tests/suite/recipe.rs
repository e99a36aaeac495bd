//! Only intact recipes are read. Each field of each section is made wrong in every way, and the error names the field.

use std::ops::Range;

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::file::HEADER_BYTES;
use glimpse_core::fit::{GaussNewton, Net, Noise, Prediction, Ridge, Sgd, Start};
use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{Pattern, Recipe};
use glimpse_core::section::{Field, Section};

use crate::recipes::*;

/// The name and the fields of a kind.
pub(crate) fn fields_of(kind: u16) -> (&'static str, &'static [Field]) {
    match kind {
        Pattern::KIND => (Pattern::NAME, Pattern::FIELDS),
        Sgd::KIND => (Sgd::NAME, Sgd::FIELDS),
        Ridge::KIND => (Ridge::NAME, Ridge::FIELDS),
        Net::KIND => (Net::NAME, Net::FIELDS),
        Start::KIND => (Start::NAME, Start::FIELDS),
        GaussNewton::KIND => (GaussNewton::NAME, GaussNewton::FIELDS),
        Noise::KIND => (Noise::NAME, Noise::FIELDS),
        Prediction::KIND => (Prediction::NAME, Prediction::FIELDS),
        _ => ("", &[]),
    }
}

/// The length of a varint at the beginning of some bytes, and its value.
fn varint(bytes: &[u8]) -> (usize, usize) {
    let (value, rest) = postcard::take_from_bytes::<u64>(bytes).unwrap();
    (bytes.len() - rest.len(), value as usize)
}

/// The bytes of each field of a section.
pub(crate) fn fields(kind: u16, bytes: &[u8]) -> Vec<(&'static Field, Range<usize>)> {
    let mut start = 0;
    let list = |bytes: &[u8]| {
        let (prefix, length) = varint(bytes);
        prefix + length
    };
    let fields = fields_of(kind).1.iter().map(|field| {
        let rest = &bytes[start..];
        let length = match field.encoding {
            "f32" => 4,
            "0, or 1 and f32" => 1 + 4 * usize::from(rest[0]),
            "list" | "bytes" => list(rest),
            "rows" => list(rest) + list(&rest[list(rest)..]),
            "0 or 1" | "u8" => 1,
            "varint" => varint(rest).0,
            other => panic!("{other}"),
        };
        let span = start..start + length;
        start = span.end;
        (field, span)
    });
    let fields = fields.collect();
    assert_eq!(start, bytes.len(), "the fields fill the section");
    fields
}

fn encoded(bytes: &[u8]) -> Vec<u8> {
    postcard::to_extend(bytes, Vec::new()).unwrap()
}

type Wrong = Vec<(Vec<u8>, ErrorCode)>;

/// Numbers outside of a range, with the code of their error.
fn wrong_numbers(field: &Field) -> Wrong {
    let (min, max) = field.range;
    let numbers = [
        f32::NAN,
        -f32::NAN,
        f32::INFINITY,
        -f32::INFINITY,
        min.next_down(),
        max.next_up(),
    ];
    let code = |x: f32| match x.is_finite() {
        true => ErrorCode::RecipeRange,
        false => ErrorCode::RecipeNonFinite,
    };
    numbers.map(|x| (packed(&[x]), code(x))).to_vec()
}

/// Lists of wrong lengths and, unless they are bytes, with wrong numbers.
fn wrong_lists(field: &Field, list: &[u8], is_bytes: bool) -> Wrong {
    let mut lengths = vec![list[1..].to_vec(), [list, &[1]].concat()];
    if !is_bytes {
        lengths.extend([list[4..].to_vec(), [list, &list[..4]].concat()]);
    }
    let lengths = lengths.into_iter();
    let mut wrong: Wrong = lengths.map(|list| (list, ErrorCode::RecipeCount)).collect();
    for (number, code) in wrong_numbers(field).into_iter().filter(|_| !is_bytes) {
        for at in [0, (list.len() / 8) * 4, list.len() - 4] {
            let (before, after) = (&list[..at], &list[at + 4..]);
            wrong.push(([before, &number, after].concat(), code));
        }
    }
    wrong.iter_mut().for_each(|(list, _)| *list = encoded(list));
    wrong
}

/// Wrong encodings of a field, with the code of their error.
fn wrong_encodings(field: &Field, bytes: &[u8]) -> Wrong {
    let (min, max) = field.range;
    let (prefix, length) = varint(bytes);
    match field.encoding {
        "0 or 1" => vec![(vec![2], ErrorCode::RecipeSections)],
        "f32" => wrong_numbers(field),
        "0, or 1 and f32" => {
            let numbers = wrong_numbers(field).into_iter();
            let numbers = numbers.map(|(number, code)| ([&[1], &number[..]].concat(), code));
            numbers
                .chain([(vec![2, 0, 0, 0, 0], ErrorCode::RecipeSections)])
                .collect()
        }
        "u8" | "varint" if max < f32::MAX => {
            let below = (min > 0.0).then(|| min as u32 - 1);
            let wrong = [max as u32 + 1].into_iter().chain(below);
            let encoded = wrong.map(|x| postcard::to_extend(&x, Vec::new()).unwrap());
            encoded
                .map(|bytes| (bytes, ErrorCode::RecipeRange))
                .collect()
        }
        "varint" => Vec::new(),
        "list" | "bytes" => wrong_lists(field, &bytes[prefix..], field.encoding == "bytes"),
        _ => {
            let (entries, scales) = bytes.split_at(prefix + length);
            let is_packed = scales != [0];
            let wrong = wrong_lists(field, &entries[prefix..], is_packed).into_iter();
            let mut wrong: Wrong = wrong
                .map(|(list, code)| ([&list, scales].concat(), code))
                .collect();
            if is_packed {
                let lists = wrong_lists(field, &scales[varint(scales).0..], false).into_iter();
                wrong.extend(lists.map(|(list, code)| ([entries, &list].concat(), code)));
            }
            wrong
        }
    }
}

/// Returns true if an error may name `named` after only the field `field` was made wrong.
///
/// It names the field itself, with one exception: a count is that of the first list which has it, so a list of wrong
/// length may be named by another list of the same section that has a count in common.
fn may_name(field: &Field, named: &str, code: ErrorCode) -> bool {
    let section = |name: &'static str| name.split('.').next().unwrap();
    let shares_count = |other: &Field| {
        let mut counts = other.length.iter();
        let is_shared = counts.any(|count| field.length.contains(count));
        is_shared && section(field.name) == section(other.name)
    };
    let all = (0..=Prediction::KIND).flat_map(|kind| fields_of(kind).1);
    let mut others = all.filter(|other| other.name == named);
    match code {
        ErrorCode::RecipeSections => named.is_empty(),
        ErrorCode::RecipeCount if named != field.name => others.any(shares_count),
        _ => named == field.name,
    }
}

/// Recipes that together have all sections, and both encodings of rows.
pub(crate) fn complete() -> Vec<Contents> {
    let net = random_recipe(SMALL, Some(ModelKind::Phong));
    vec![
        sgd(ModelKind::CookTorrance),
        with_noise(with_differences(linear())).predicted(),
        with_differences(net).predicted(),
    ]
}

#[test]
fn errors_name_wrong_fields() {
    let mut seen = std::collections::BTreeMap::new();
    for contents in complete() {
        let sections = contents.sections();
        for (index, (kind, bytes)) in sections.iter().enumerate() {
            for (field, span) in fields(*kind, bytes) {
                for (wrong, code) in wrong_encodings(field, &bytes[span.clone()]) {
                    let mut sections = sections.clone();
                    let (_, bytes) = &mut sections[index];
                    bytes.splice(span.clone(), wrong.iter().copied());
                    let error = parse_error(&contents.write_with(&sections));
                    let is_right = error.code == code && may_name(field, error.field, code);
                    assert!(is_right, "{field:?} {wrong:?}: {error:?}, not {code:?}");
                    *seen.entry(field.name).or_insert(0) += 1;
                }
            }
        }
    }
    // The only fields without a wrong value.
    let counts = (0..=Prediction::KIND).map(|kind| fields_of(kind).1.len());
    assert_eq!(seen.len() + 1, counts.sum());
    assert!(!seen.contains_key("ridge.basis_checksum"));
}

/// Each field at both ends of its range.
#[test]
fn bounds_are_valid() {
    for contents in complete() {
        let sections = contents.sections();
        for (index, (kind, bytes)) in sections.iter().enumerate() {
            for (field, span) in fields(*kind, bytes) {
                if !matches!(field.encoding, "f32" | "list") || field.name.ends_with("directions") {
                    continue;
                }
                for bound in [field.range.0, field.range.1] {
                    let mut sections = sections.clone();
                    let start = span.end - 4;
                    sections[index].1[start..span.end].copy_from_slice(&bound.to_le_bytes());
                    let parsed = Recipe::parse(&contents.write_with(&sections)).map(drop);
                    assert_eq!(parsed, Ok(()), "{}", field.name);
                }
            }
        }
    }
}

/// Each count at its largest value, and above.
#[test]
fn counts_are_bounded() {
    let with = |change: &dyn Fn(&mut Shape), model| {
        let mut shape = SMALL;
        change(&mut shape);
        random_recipe(shape, model)
    };
    let phong = Some(ModelKind::Phong);
    type Set = fn(&mut Shape, usize);
    let cases: [(Set, [usize; 4], _); 5] = [
        (|shape, k| shape.components = k, [4, 1024, 3, 1025], None),
        (|shape, h| shape.hidden = h, [0, 92, 93, 94], None),
        (|shape, g| shape.units = g, [1, 32, 0, 33], phong),
        (
            |shape, v| shape.virtual_readings = v,
            [1, 1024, 0, 1025],
            phong,
        ),
        (|shape, n| shape.samples = n, [1, 4096, 0, 4097], None),
    ];
    for (set, [min, max, below, above], model) in cases {
        let code = |count| {
            let bytes = with(&|shape| set(shape, count), model).write();
            Recipe::parse(&bytes).err().map(|error| error.code)
        };
        assert_eq!([min, max].map(code), [None; 2]);
        assert!(code(below).is_some(), "{below}");
        assert_eq!(code(above), Some(ErrorCode::RecipeCount));
    }
    // More coefficients of the net than components, and an undefined treatment of missing readings.
    let mut larger = random_recipe(SMALL, None);
    let mut undefined = larger.clone();
    larger.ridge = with(&|shape| shape.components = 3, None).ridge;
    undefined.net.as_mut().unwrap().missing = 1;
    for (contents, field) in [(larger, "net.components"), (undefined, "net.missing")] {
        let error = parse_error(&contents.write());
        assert_eq!((error.code, error.field), (ErrorCode::RecipeRange, field));
    }
    // Linear is not a model with parameters, and other models have other numbers of them.
    for model in [ModelKind::Linear, ModelKind::Neural] {
        let mut contents = sgd(ModelKind::Phong);
        contents.sgd.as_mut().unwrap().model = number_of(model);
        let error = parse_error(&contents.write());
        assert!(error.field.starts_with("sgd."), "{error:?}");
    }
}

#[test]
fn directions_are_above_horizon() {
    let mut contents = random_recipe(SMALL, Some(ModelKind::Phong));
    contents.pattern.directions[9] += 100.0 * std::f32::consts::TAU; // whole turns are valid
    assert!(Recipe::parse(&contents.write()).is_ok());
    let mut below = contents.clone();
    below.pattern.directions[9] = 1.6;
    let error = parse_error(&below.write());
    let expected = (ErrorCode::RecipeBelowHorizon, [3, 0]);
    assert_eq!((error.code, error.details), expected);
    let mut below = contents;
    below.gauss_newton.as_mut().unwrap().directions[6] = 1.6;
    let error = parse_error(&below.write());
    assert_eq!(
        (error.code, error.field),
        (ErrorCode::RecipeRange, "gauss_newton.directions")
    );
}

#[test]
fn recipe_reports_contents() {
    for (name, mut contents) in combinations() {
        contents.metadata = Some(vec![1, 2, 3]);
        let recipe = contents.recipe();
        assert_eq!(recipe.model(), contents.model(), "{name}");
        assert_eq!(recipe.samples(), contents.samples());
        assert_eq!(recipe.memory_words(), contents.words());
        assert_eq!(recipe.expected_loss(), contents.pattern.expected_loss);
        assert_eq!(recipe.is_in_path_order(), contents.pattern.is_path);
        let is_posterior = contents.net.is_some() || contents.noise.is_some();
        assert_eq!(recipe.tolerates_missing(), is_posterior);
        assert!(!recipe.bounds_partial_loss());
        assert_eq!(recipe.metadata(), [1, 2, 3]);
        let checksum = contents
            .ridge
            .as_ref()
            .map_or(0, |ridge| ridge.basis_checksum);
        let expected = Some(checksum).filter(|checksum| *checksum > 0);
        assert_eq!(recipe.basis_checksum(), expected);
        let angles = recipe.pattern().flat_map(|a| a.to_array());
        assert!(angles.eq(contents.pattern.directions));
        let directions = recipe
            .pattern()
            .map(|angles| HalfDifference::from_angles(angles).directions());
        assert!(recipe.directions().eq((0..).zip(directions)));
    }
    assert!(linear().recipe().metadata().is_empty());
}

/// The kind that is missing in or excluded from each combination of sections, or none.
#[test]
fn names_missing_and_extra_sections() {
    let all = random_recipe(SMALL, Some(ModelKind::Phong)).predicted();
    let (sgd, metadata) = (sgd(ModelKind::Phong).sgd, Some(Vec::new()));
    let all = Contents {
        sgd,
        metadata,
        ..all
    };
    let sections = all.sections();
    assert_eq!(sections.len(), 8);
    for mask in 0..256_u32 {
        let has = |index: usize| mask >> index & 1 == 1;
        let sections = sections.iter().enumerate().filter(|(index, _)| has(*index));
        let sections: Vec<_> = sections.map(|(_, section)| section.clone()).collect();
        let expected = match [has(0), has(1), has(2), has(4), has(5)] {
            [false, ..] => Some(0),
            [_, false, false, ..] => Some(2),
            [_, true, false, ..] if has(3) || has(4) || has(5) || has(6) => Some(2),
            [_, true, true, ..] => Some(1),
            [.., true, false] => Some(5),
            [.., false, true] => Some(4),
            _ => None,
        };
        // Other errors follow: those of counts of the sections that are left out.
        let error = Recipe::parse(&all.write_with(&sections)).err();
        let error = error.filter(|error| error.code == ErrorCode::RecipeSections);
        let expected = expected.map(|kind| Error::with(ErrorCode::RecipeSections, [kind, 0]));
        let is_earlier = !has(3) && has(6) && error.is_none();
        assert!(error == expected || is_earlier, "{mask:b}: {error:?}");
    }
}

#[test]
fn skips_or_rejects_unknown_kinds() {
    for contents in complete() {
        let mut sections = contents.sections();
        sections.push((138, b"from the future".to_vec()));
        sections.push((u16::MAX, Vec::new()));
        assert!(Recipe::parse(&contents.write_with(&sections)).is_ok());
        for kind in [7, 127] {
            let mut sections = sections.clone();
            let at = sections
                .iter()
                .position(|(other, _)| *other > kind)
                .unwrap();
            sections.insert(at, (kind, Vec::new()));
            let error = Error::with(ErrorCode::RecipeUnknown, [kind.into(), 0]);
            assert_eq!(parse_error(&contents.write_with(&sections)), error);
        }
    }
}

/// Sections in another order, twice, cut, padded, or with a few bytes after the last.
#[test]
fn rejects_damaged_list_of_sections() {
    for contents in complete() {
        let mut all = contents.sections();
        all.push((200, vec![7]));
        let error = |sections: &Sections| {
            let error = parse_error(&contents.write_with(sections));
            (error.code, error.details[0] as u16)
        };
        for index in 0..all.len() {
            let kind = all[index].0;
            let expected = (ErrorCode::RecipeSections, kind);
            for place in [index, all.len()] {
                let mut twice = all.clone();
                twice.insert(place, all[index].clone());
                assert_eq!(error(&twice), expected);
            }
            if index + 1 < all.len() {
                let mut swapped = all.clone();
                swapped.swap(index, index + 1);
                assert_eq!(error(&swapped), expected);
                for length in 0..all[index].1.len() {
                    let mut cut = all.clone();
                    cut[index].1.truncate(length);
                    assert_eq!(error(&cut), expected, "{length}");
                }
                let mut padded = all.clone();
                padded[index].1.push(0);
                assert_eq!(error(&padded), expected);
            }
        }
        let body = contents.write().split_off(HEADER_BYTES);
        for tail in [&[0x80][..], &[0xFF, 0xFF, 0xFF], &[0xC8, 0x01, 5, 1, 2]] {
            let bytes = with_header(VERSION, &[&body, tail].concat());
            assert_eq!(parse_error(&bytes).code, ErrorCode::RecipeMalformed);
        }
        for (length, code) in [
            (0, ErrorCode::RecipeLength),
            (5, ErrorCode::RecipeLength),
            (6, ErrorCode::RecipeSections),
        ] {
            let actual = parse_error(&with_header(VERSION, &body[..length])).code;
            assert_eq!(actual, code);
        }
    }
}

#[test]
fn rejects_other_sizes_in_header() {
    for contents in complete() {
        let body = contents.write().split_off(HEADER_BYTES);
        for index in 0..6 {
            for change in [1, 0x80] {
                let mut body = body.clone();
                body[index] ^= change;
                let samples = u16::from_le_bytes([body[0], body[1]]);
                let words = u32::from_le_bytes(body[2..6].try_into().unwrap());
                let error = Error::with(ErrorCode::RecipeHeader, [samples.into(), words]);
                assert_eq!(parse_error(&with_header(VERSION, &body)), error);
            }
        }
    }
}
