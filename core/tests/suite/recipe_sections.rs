//! The sections of a recipe: each is read, skipped or rejected, depending on its kind.

mod training;

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::gonio::{Limits, Speeds};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{
    Effort, ExpectedLoss, HEADER_BYTES, Kind, Metadata, Noise, Origin, PackedDescent, PackedMethod,
    Parts, Provenance, Recipe, RecipeError, RecipeParts, ScanTime, Schedule, Training,
    TrainingSource, TrainingSources, VERSION, ValidationSplit,
};
use proptest::prelude::*;

use crate::completion::partial::all_small;
use crate::recipes::{
    Sections, linear, packed, parsed, recipe_with, section_mut, sections_of, with_header, write,
};
use crate::scanning::{encoded_recipe, recipe_for};

const LIMITS: Limits = Limits {
    max_theta_i: 1.3,
    max_theta_o: 1.4,
    min_separation: 0.1,
    in_plane: true,
};
const NOISE: Noise = Noise {
    multiplicative: 0.05,
    additive: 1e-4,
    levels: 4096,
};
const EXPECTATION: ExpectedLoss<'_> = ExpectedLoss {
    loss: 0.0125,
    standard_error: Some(0.0015),
    materials: 10,
    on: "materials held out",
};
const PROVENANCE: Provenance<'_> = Provenance {
    trainer: "a trainer",
    data: "some materials",
    materials: 100,
    schedule: "a schedule",
    seed: u64::MAX,
    options: "no options",
};
const MATERIALS: [(&str, u32); 3] = [("alum-bronze", 1), ("", u32::MAX), ("Stoff für Bühnen", 0)];

const SCAN_TIME: ScanTime = ScanTime {
    speeds: Speeds {
        theta_i: 0.5,
        phi_i: 0.0,
        theta_o: 0.25,
        phi_o: 1.5,
    },
    settle: 0.1,
    seconds: 60.0,
};

const fn source(label: &str, origin: Origin, materials: u32, share: f32) -> TrainingSource<'_> {
    TrainingSource {
        label,
        origin,
        materials,
        share,
    }
}

const SOURCES: [TrainingSource<'_>; 3] = [
    source("MERL", Origin::Files, 100, 0.6),
    source("Stoff für Bühnen", Origin::Files, u32::MAX, 0.0),
    source("", Origin::BuiltIn, 0, 1.0),
];
const TRAINING: Training<'_> = Training {
    schedule: Schedule::Prior,
    effort: Effort::Standard,
    parts: Parts::WithoutPattern,
    split: ValidationSplit::Folds,
    digest: u64::MAX,
    sources: TrainingSources::new(&SOURCES),
};

/// A recipe of the model Phong with all sections that a descent may have.
fn full_parts() -> RecipeParts<'static> {
    let ones: &'static [u8] = packed(&[1.0; 7]).leak();
    RecipeParts {
        pattern: &[0; 24],
        method: PackedMethod::Descent(PackedDescent {
            model: ModelKind::Phong,
            inner_steps: 20,
            initial: ones,
            step_sizes: ones,
        }),
        limits: Some(LIMITS),
        noise: Some(NOISE),
        expectation: Some(EXPECTATION),
        provenance: Some(PROVENANCE),
        materials: &MATERIALS,
        prediction: None,
        training: Some(TRAINING),
        uncertainty: None,
        scan_time: Some(SCAN_TIME),
        partial: None,
    }
}

pub(crate) fn full_sections() -> Sections {
    sections_of(&write(&full_parts()).unwrap())
}

/// The error of a recipe with these sections, or of its metadata.
fn parse_error(sections: &Sections) -> RecipeError {
    let bytes = recipe_with(sections);
    let metadata = Recipe::parse(&bytes).and_then(|recipe| recipe.metadata());
    metadata.map(drop).unwrap_err()
}

#[test]
fn section_round_trip() {
    let bytes = write(&full_parts()).unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    let metadata = recipe.metadata().unwrap();
    assert_eq!(metadata.limits, Some(LIMITS));
    assert_eq!(metadata.noise, Some(NOISE));
    assert_eq!(metadata.expectation, Some(EXPECTATION));
    assert_eq!(recipe.expected_loss(), Some(0.0125));
    assert_eq!(metadata.provenance, Some(PROVENANCE));
    assert_eq!(metadata.materials.len(), 3);
    assert!(metadata.materials.eq(MATERIALS));
    assert_eq!(metadata.training, Some(TRAINING));
    assert_eq!(metadata.scan_time, Some(SCAN_TIME));
    let kinds: Vec<u16> = recipe.sections().map(|(kind, _)| kind.number()).collect();
    assert_eq!(kinds, [0, 1, 128, 129, 130, 131, 132, 134, 136]);
    // The test's own writer gives the same bytes.
    assert_eq!(recipe_with(&full_sections()), bytes);
}

#[test]
fn optional_sections_may_be_missing() {
    let bytes = write(&RecipeParts::new(full_parts().pattern, full_parts().method)).unwrap();
    let mut sections = sections_of(&bytes);
    assert_eq!(sections.len(), 2);
    // An empty list of materials is valid.
    sections.push((Kind::MATERIALS, vec![0]));
    for bytes in [bytes, recipe_with(&sections)] {
        let recipe = parsed(bytes);
        let metadata = recipe.metadata().unwrap();
        assert_eq!((metadata.limits, metadata.noise), (None, None));
        assert_eq!(metadata.expectation, None);
        assert_eq!(metadata.provenance, None);
        assert_eq!(metadata.materials.count(), 0);
        assert_eq!(metadata.training, None);
        assert_eq!(metadata.scan_time, None);
        assert_eq!(recipe.expected_loss(), None);
    }
}

#[test]
fn names_missing_required_section() {
    let without = |kind| {
        let mut sections = full_sections();
        sections.retain(|(other, _)| *other != kind);
        parse_error(&sections)
    };
    let missing = without(Kind::PATTERN);
    assert_eq!(missing, RecipeError::Missing(Kind::PATTERN));
    assert_eq!(without(Kind::DESCENT), RecipeError::Learners(0));
    let error = RecipeError::Missing(Kind::PATTERN);
    assert_eq!(parse_error(&Vec::new()), error);

    let mut both = full_sections();
    let ridge = sections_of(&linear().write().unwrap()).swap_remove(1);
    assert_eq!(ridge.0, Kind::RIDGE);
    both.insert(2, ridge);
    let error = parse_error(&both);
    assert_eq!(error, RecipeError::Learners(2));
}

#[test]
fn skips_or_rejects_unknown_kinds() {
    let mut sections = full_sections();
    sections.push((Kind::new(138), b"from the future".to_vec()));
    sections.push((Kind::new(u16::MAX), Vec::new()));
    let recipe = parsed(recipe_with(&sections));
    assert!(recipe.metadata().unwrap().materials.eq(MATERIALS));
    let unknown = (Kind::new(138), &b"from the future"[..]);
    assert!(recipe.sections().any(|section| section == unknown));
    assert_eq!(Kind::new(138).name(), None);

    for kind in [7, 127].map(Kind::new) {
        let mut sections = sections.clone();
        sections.insert(2, (kind, Vec::new()));
        let error = parse_error(&sections);
        assert_eq!(error, RecipeError::Unknown(kind));
        let error = Error::from(error);
        assert_eq!(error.code, ErrorCode::RecipeUnknown);
        assert_eq!(error.details, [kind.number().into(), 0]);
    }
    assert!(Kind::new(127).is_required() && !Kind::new(128).is_required());
}

#[test]
fn rejects_duplicate_or_unordered_kinds() {
    let mut all = full_sections();
    all.push((Kind::new(200), Vec::new()));
    for index in 0..all.len() {
        let error = RecipeError::Order(all[index].0);
        for place in [index, all.len()] {
            let mut twice = all.clone();
            twice.insert(place, all[index].clone());
            assert_eq!(parse_error(&twice), error);
        }
        if index + 1 < all.len() {
            let mut swapped = all.clone();
            swapped.swap(index, index + 1);
            assert_eq!(parse_error(&swapped), error);
        }
    }
}

#[test]
fn rejects_cut_or_padded_section() {
    let completed = all_small().map(|contents| sections_of(&contents.write()));
    for all in completed.chain([full_sections()]) {
        for index in 0..all.len() {
            let error = RecipeError::Section(all[index].0);
            for length in 0..all[index].1.len() {
                let mut cut = all.clone();
                cut[index].1.truncate(length);
                assert_eq!(parse_error(&cut), error, "{length}");
            }
            let mut padded = all.clone();
            padded[index].1.push(0);
            assert_eq!(parse_error(&padded), error);
        }
    }
}

#[test]
fn body_ending_within_section_is_malformed() {
    let whole = write(&full_parts()).unwrap();
    let body = &whole[HEADER_BYTES..];
    for tail in [&[0x80][..], &[0xFF, 0xFF, 0xFF], &[0xC8, 0x01, 5, 1, 2]] {
        let bytes = with_header(VERSION, &[body, tail].concat());
        assert_eq!(Recipe::parse(&bytes).err(), Some(RecipeError::Malformed));
    }
    let bytes = with_header(VERSION, &body[..body.len() - 1]);
    assert_eq!(Recipe::parse(&bytes).err(), Some(RecipeError::Malformed));
}

/// The writer checks metadata, too.
#[test]
fn invalid_metadata_is_not_written() {
    let mut parts = full_parts();
    parts.limits.as_mut().unwrap().max_theta_o = 75.0; // degrees instead of radians
    let error = RecipeError::Limits(Error::in_field(ErrorCode::Limits, "limits.max_theta_o"));
    assert_eq!(write(&parts), Err(error));
}

/// A scan does not need metadata. Invalid metadata only matters when it is read.
#[test]
fn invalid_metadata_fails_only_when_read() {
    for (kind, expected_loss) in [
        (Kind::EXPECTATION, None),
        (Kind::TRAINING, Some(EXPECTATION.loss)),
    ] {
        let mut sections = full_sections();
        section_mut(&mut sections, kind).clear();
        let recipe = parsed(recipe_with(&sections));
        assert_eq!(recipe.samples(), full_parts().pattern.len() / 12);
        let error = recipe.metadata().unwrap_err();
        assert_eq!(error, RecipeError::Section(kind));
        assert_eq!(recipe.expected_loss(), expected_loss);
    }
}

#[test]
fn copy_omits_only_named_sections() {
    let mut sections = full_sections();
    sections.push((Kind::new(1000), b"unknown".to_vec()));
    let bytes = recipe_with(&sections);
    let recipe = Recipe::parse(&bytes).unwrap();
    let copy = |kinds: &[Kind]| {
        let mut buffer = vec![0; bytes.len()];
        let copy = recipe.copy_without(kinds, &mut buffer);
        copy.map(<[u8]>::to_vec)
    };
    let optional = [128, 129, 130, 131, 132, 134, 136, 1000].map(Kind::new);
    for kind in optional {
        let copied = copy(&[kind]).unwrap();
        let mut expected = sections.clone();
        expected.retain(|(other, _)| *other != kind);
        assert_eq!(sections_of(&copied), expected);
    }
    assert_eq!(sections_of(&copy(&optional).unwrap()), sections[..2]);
    // A section that the recipe lacks is ignored.
    assert_eq!(copy(&[Kind::new(999)]).unwrap(), bytes);
    assert_eq!(copy(&[]).unwrap(), bytes);
    for kind in [Kind::PATTERN, Kind::DESCENT, Kind::RIDGE, Kind::new(7)] {
        let error = copy(&[Kind::NOISE, kind]).unwrap_err();
        assert_eq!(error, RecipeError::Required(kind));
    }
    for length in 0..bytes.len() {
        let error = recipe.copy_without(&[], &mut vec![0; length]).unwrap_err();
        assert_eq!(error, RecipeError::BufferTooSmall);
    }
}

#[test]
fn rejects_small_buffer() {
    let linear = recipe_for(ModelKind::Linear);
    let pattern = vec![0; 12 * linear.samples()];
    let ridge = RecipeParts::new(&pattern, linear.method().into());
    for parts in [full_parts(), ridge] {
        let whole = write(&parts).unwrap();
        for length in 0..whole.len() {
            let error = Recipe::write(&parts, &mut vec![0; length]).unwrap_err();
            assert_eq!(error, RecipeError::BufferTooSmall);
        }
        assert!(Recipe::write(&parts, &mut vec![0; whole.len()]).is_ok());
    }
}

/// A list with a count larger than its materials is rejected at the end of its bytes.
#[test]
fn rejects_list_of_four_billion_materials() {
    let mut sections = full_sections();
    let bytes = section_mut(&mut sections, Kind::MATERIALS);
    bytes.splice(0..1, [0xFF, 0xFF, 0xFF, 0xFF, 0x0F]);
    assert_eq!(
        parse_error(&sections),
        RecipeError::Section(Kind::MATERIALS)
    );
}

proptest! {
    #[test]
    fn noise_section_is_rejected_or_valid(
        which in 0..9usize,
        noise in prop::collection::vec(any::<u8>(), 0..80),
    ) {
        let mut sections = full_sections();
        sections[which].1 = noise;
        let bytes = recipe_with(&sections);
        match Recipe::parse(&bytes) {
            Ok(recipe) => {
                if let Ok(Metadata { materials, training, .. }) = recipe.metadata() {
                    prop_assert_eq!(materials.count(), materials.len());
                    let sources = training.map(|training| training.sources);
                    prop_assert!(sources.is_none_or(|sources| sources.count() == sources.len()));
                } else {
                    prop_assert!(which >= 2, "section {which} is not metadata");
                }
                let mut buffer = vec![0; bytes.len()];
                prop_assert_eq!(recipe.copy_without(&[], &mut buffer).unwrap(), &bytes[..]);
            }
            Err(error) => {
                let of_body = !matches!(error, RecipeError::Checksum | RecipeError::Malformed);
                prop_assert!(of_body, "{}", error);
            }
        }
    }

    #[test]
    fn reads_materials_of_any_name(names in prop::collection::vec((".{0,40}", any::<u32>()), 0..30)) {
        let list: Vec<(&str, u32)> = names.iter().map(|(name, digest)| (&name[..], *digest)).collect();
        let bytes = write(&RecipeParts { materials: &list, ..full_parts() }).unwrap();
        let recipe = Recipe::parse(&bytes).unwrap();
        prop_assert!(recipe.metadata().unwrap().materials.eq(list.iter().copied()));
    }
}

/// A recipe of a realistic size is not much longer than its numbers.
#[test]
fn sections_add_few_bytes() {
    let bytes = encoded_recipe(ModelKind::Neural);
    let numbers = 4 * (24 + 2 * 675);
    assert!(bytes.len() < numbers + 100, "{}", bytes.len());
}
