//! A recipe is a list of sections: each is read, passed over or refused, by the number of its kind.

mod common;
mod forged;

use common::{neural, write, write_linear};
use forged::sealed;
use glimpse_core::gonio::{Limits, LimitsError};
use glimpse_core::recipe::{
    Effort, Expectation, Field, Ingredients, Kind, Noise, Origin, PackedDescent, PackedLearner,
    Parts, Provenance, Recipe, RecipeError, Schedule, Statements, Training, TrainingSource,
    TrainingSources, VERSION, ValidationSplit,
};
use proptest::prelude::*;

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
const EXPECTATION: Expectation<'_> = Expectation {
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

const SOURCES: [TrainingSource<'_>; 3] = [
    TrainingSource {
        label: "MERL",
        origin: Origin::Files,
        materials: 100,
        share: 0.6,
    },
    TrainingSource {
        label: "Stoff für Bühnen",
        origin: Origin::Files,
        materials: u32::MAX,
        share: 0.0,
    },
    TrainingSource {
        label: "",
        origin: Origin::BuiltIn,
        materials: 0,
        share: 1.0,
    },
];
const TRAINING: Training<'_> = Training {
    schedule: Schedule::Prior,
    effort: Effort::Standard,
    parts: Parts::WithoutPattern,
    split: ValidationSplit::Folds,
    digest: u64::MAX,
    sources: TrainingSources::new(&SOURCES),
};

/// A recipe of the model Phong with all sections that there are.
fn full() -> Ingredients<'static> {
    let ones = &[0, 0, 0x80, 0x3F].repeat(7);
    let ones: &'static [u8] = ones.clone().leak();
    Ingredients {
        pattern: &[0; 24],
        learner: PackedLearner::Descent(PackedDescent {
            model: glimpse_core::model::ModelKind::Phong,
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
    }
}

fn written(ingredients: &Ingredients<'_>) -> Result<Vec<u8>, RecipeError> {
    let mut buffer = vec![0; 1 << 14];
    Recipe::write(ingredients, &mut buffer).map(<[u8]>::to_vec)
}

/// Sections as a recipe, whatever they are.
fn recipe_of(sections: &[(u16, Vec<u8>)]) -> Vec<u8> {
    let mut body = Vec::new();
    for (kind, bytes) in sections {
        for mut number in [usize::from(*kind), bytes.len()] {
            while number >= 0x80 {
                body.push(number as u8 | 0x80);
                number >>= 7;
            }
            body.push(number as u8);
        }
        body.extend(bytes);
    }
    sealed(VERSION, &body)
}

/// The sections of a recipe.
fn sections_of(bytes: &[u8]) -> Vec<(u16, Vec<u8>)> {
    let sections = Recipe::parse(bytes).unwrap().sections();
    sections
        .map(|(kind, bytes)| (kind.number(), bytes.to_vec()))
        .collect()
}

fn refusal(sections: &[(u16, Vec<u8>)]) -> RecipeError {
    let bytes = recipe_of(sections);
    let statements = Recipe::parse(&bytes).and_then(|recipe| recipe.statements());
    statements.map(drop).unwrap_err()
}

#[test]
fn every_section_that_is_written_is_read() {
    let bytes = written(&full()).unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    let statements = recipe.statements().unwrap();
    assert_eq!(statements.limits, Some(LIMITS));
    assert_eq!(statements.noise, Some(NOISE));
    assert_eq!(statements.expectation, Some(EXPECTATION));
    assert_eq!(recipe.expected_loss(), Some(0.0125));
    assert_eq!(statements.provenance, Some(PROVENANCE));
    assert_eq!(statements.materials.len(), 3);
    assert!(statements.materials.eq(MATERIALS));
    assert_eq!(statements.training, Some(TRAINING));
    let kinds: Vec<u16> = recipe.sections().map(|(kind, _)| kind.number()).collect();
    assert_eq!(kinds, [0, 1, 128, 129, 130, 131, 132, 134]);
    // The test's own writer agrees.
    assert_eq!(recipe_of(&sections_of(&bytes)), bytes);
}

#[test]
fn what_is_optional_may_be_missing() {
    let bytes = written(&Ingredients::new(full().pattern, full().learner)).unwrap();
    let recipe = Recipe::parse(&bytes).unwrap();
    let statements = recipe.statements().unwrap();
    assert_eq!((statements.limits, statements.noise), (None, None));
    assert_eq!(
        (statements.expectation, statements.provenance),
        (None, None)
    );
    assert_eq!(statements.materials.count(), 0);
    assert_eq!(statements.training, None);
    assert_eq!(recipe.expected_loss(), None);
    assert_eq!(sections_of(&bytes).len(), 2);
    // A list of no materials is no mistake.
    let mut sections = sections_of(&bytes);
    sections.push((132, vec![0]));
    let bytes = recipe_of(&sections);
    let statements = Recipe::parse(&bytes).unwrap().statements().unwrap();
    assert_eq!(statements.materials.count(), 0);
}

#[test]
fn what_is_required_is_missed_by_name() {
    let all = sections_of(&written(&full()).unwrap());
    let without = |kind| {
        let mut sections = all.clone();
        sections.retain(|(other, _)| *other != kind);
        refusal(&sections)
    };
    let missing = without(0);
    assert_eq!(missing, RecipeError::Missing(Kind::PATTERN));
    let text = missing.to_string();
    assert!(text.contains(&Kind::PATTERN.to_string()), "{text}");
    assert_eq!(without(1), RecipeError::Learners(0));
    assert_eq!(refusal(&[]), RecipeError::Missing(Kind::PATTERN));

    let mut both = all.clone();
    let ridge = sections_of(&write_linear(&common::linear()).unwrap())[1].clone();
    assert_eq!(ridge.0, Kind::RIDGE.number());
    both.insert(2, ridge);
    let error = refusal(&both);
    assert_eq!(error, RecipeError::Learners(2));
    let text = error.to_string();
    assert!(text.contains(&Kind::DESCENT.to_string()), "{text}");
}

#[test]
fn an_unknown_kind_is_passed_over_or_refused_by_its_number() {
    let mut sections = sections_of(&written(&full()).unwrap());
    sections.push((135, b"from the future".to_vec()));
    sections.push((u16::MAX, Vec::new()));
    let bytes = recipe_of(&sections);
    let recipe = Recipe::parse(&bytes).unwrap();
    assert!(recipe.statements().unwrap().materials.eq(MATERIALS));
    let unknown = (Kind::new(135), &b"from the future"[..]);
    assert!(recipe.sections().any(|section| section == unknown));
    assert_eq!(Kind::new(135).name(), None);

    for kind in [5, 127] {
        let mut sections = sections.clone();
        sections.insert(2, (kind, Vec::new()));
        let error = refusal(&sections);
        assert_eq!(error, RecipeError::Unknown(Kind::new(kind)));
        let text = error.to_string();
        assert!(text.contains(&kind.to_string()), "{text}");
    }
    assert!(Kind::new(127).is_required() && !Kind::new(128).is_required());
}

#[test]
fn no_kind_is_there_twice_or_out_of_order() {
    let mut all = sections_of(&written(&full()).unwrap());
    all.push((200, Vec::new()));
    for index in 0..all.len() {
        let mut twice = all.clone();
        twice.insert(index, all[index].clone());
        let kind = Kind::new(all[index].0);
        assert_eq!(refusal(&twice), RecipeError::Order(kind));
        let mut again = all.clone();
        again.push(all[index].clone());
        assert_eq!(refusal(&again), RecipeError::Order(kind));
        if index > 0 {
            let mut swapped = all.clone();
            swapped.swap(index - 1, index);
            let kind = Kind::new(all[index - 1].0);
            assert_eq!(refusal(&swapped), RecipeError::Order(kind));
        }
    }
}

#[test]
fn a_section_that_is_cut_or_padded_is_refused_by_its_kind() {
    let all = sections_of(&written(&full()).unwrap());
    for index in 0..all.len() {
        let kind = Kind::new(all[index].0);
        for length in 0..all[index].1.len() {
            let mut cut = all.clone();
            cut[index].1.truncate(length);
            assert_eq!(refusal(&cut), RecipeError::Section(kind), "{length}");
        }
        let mut padded = all.clone();
        padded[index].1.push(0);
        assert_eq!(refusal(&padded), RecipeError::Section(kind));
    }
    // Text that is not UTF-8.
    for (index, name) in [
        (4, &b"held"[..]),
        (5, b"trainer"),
        (6, b"bronze"),
        (7, b"MERL"),
    ] {
        let mut wrong = all.clone();
        let bytes = &mut wrong[index].1;
        let at = bytes.windows(name.len()).position(|text| text == name);
        bytes[at.unwrap()] = 0xFF;
        let kind = Kind::new(all[index].0);
        assert_eq!(refusal(&wrong), RecipeError::Section(kind));
    }
}

#[test]
fn what_follows_the_last_section_is_malformed() {
    let whole = written(&full()).unwrap();
    let body = &whole[14..];
    for tail in [&[0x80][..], &[0xFF, 0xFF, 0xFF], &[0xC8, 0x01, 5, 1, 2]] {
        let error = Recipe::parse(&sealed(VERSION, &[body, tail].concat())).unwrap_err();
        assert_eq!(error, RecipeError::Malformed);
    }
    let error = Recipe::parse(&sealed(VERSION, &body[..body.len() - 1])).unwrap_err();
    assert_eq!(error, RecipeError::Malformed);
}

#[test]
fn statements_are_checked_by_field() {
    let with = |change: &dyn Fn(&mut Ingredients<'_>)| {
        let mut ingredients = full();
        change(&mut ingredients);
        written(&ingredients).map(drop)
    };
    let limits = |limits| with(&|ingredients| ingredients.limits = Some(limits));
    let noise = |noise| with(&|ingredients| ingredients.noise = Some(noise));
    let expectation = |each| with(&|ingredients| ingredients.expectation = Some(each));
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let refused = |field| Err(RecipeError::NonFinite(field));
        let each = |max_theta_i| Limits {
            max_theta_i,
            ..LIMITS
        };
        assert_eq!(
            limits(each(bad)),
            Err(RecipeError::Limits(LimitsError::MaxThetaI))
        );
        let each = |max_theta_o| Limits {
            max_theta_o,
            ..LIMITS
        };
        assert_eq!(
            limits(each(bad)),
            Err(RecipeError::Limits(LimitsError::MaxThetaO))
        );
        let each = |min_separation| Limits {
            min_separation,
            ..LIMITS
        };
        assert_eq!(
            limits(each(bad)),
            Err(RecipeError::Limits(LimitsError::MinSeparation))
        );
        let each = |multiplicative| Noise {
            multiplicative,
            ..NOISE
        };
        assert_eq!(noise(each(bad)), refused(Field::Multiplicative));
        let each = |additive| Noise { additive, ..NOISE };
        assert_eq!(noise(each(bad)), refused(Field::Additive));
        let each = |loss| Expectation {
            loss,
            ..EXPECTATION
        };
        assert_eq!(expectation(each(bad)), refused(Field::ExpectedLoss));
        let each = |error| Expectation {
            standard_error: Some(error),
            ..EXPECTATION
        };
        assert_eq!(expectation(each(bad)), refused(Field::StandardError));
    }
    // Degrees, and a limit that would let nothing through.
    for bad in [75.0, -0.1] {
        let each = Limits {
            max_theta_o: bad,
            ..LIMITS
        };
        assert_eq!(
            limits(each),
            Err(RecipeError::Limits(LimitsError::MaxThetaO))
        );
    }
    let each = Noise {
        additive: -1e-9,
        ..NOISE
    };
    assert_eq!(noise(each), Err(RecipeError::Negative(Field::Additive)));
    let each = Expectation {
        standard_error: Some(-1e-9),
        ..EXPECTATION
    };
    let negative = RecipeError::Negative(Field::StandardError);
    assert_eq!(expectation(each), Err(negative));
    let each = Expectation {
        standard_error: None,
        ..EXPECTATION
    };
    assert_eq!(expectation(each), Ok(()));
}

/// A scan needs no statement: one that makes no sense stops nobody who does not ask for it.
#[test]
fn a_bad_statement_is_an_error_only_of_those_who_ask() {
    let mut sections = sections_of(&written(&full()).unwrap());
    sections[4].1.clear();
    let bytes = recipe_of(&sections);
    let recipe = Recipe::parse(&bytes).unwrap();
    assert_eq!(recipe.samples(), full().pattern.len() / 12);
    let error = recipe.statements().unwrap_err();
    assert_eq!(error, RecipeError::Section(Kind::EXPECTATION));
    assert_eq!(recipe.expected_loss(), None);

    // The loss alone is read although another statement is damaged.
    let mut sections = sections_of(&written(&full()).unwrap());
    sections.last_mut().unwrap().1.clear();
    let bytes = recipe_of(&sections);
    let recipe = Recipe::parse(&bytes).unwrap();
    let error = recipe.statements().unwrap_err();
    assert_eq!(error, RecipeError::Section(Kind::TRAINING));
    assert_eq!(recipe.expected_loss(), Some(EXPECTATION.loss));
}

#[test]
fn a_copy_lacks_what_it_was_to_lack_and_nothing_else() {
    let mut sections = sections_of(&written(&full()).unwrap());
    sections.push((1000, b"unknown".to_vec()));
    let bytes = recipe_of(&sections);
    let recipe = Recipe::parse(&bytes).unwrap();
    let copy = |kinds: &[Kind]| {
        let mut buffer = vec![0; bytes.len()];
        let copy = recipe.copy_without(kinds, &mut buffer);
        copy.map(<[u8]>::to_vec)
    };
    assert_eq!(copy(&[]).unwrap(), bytes);
    let named = copy(&[Kind::MATERIALS]).unwrap();
    assert!(!named.windows(6).any(|text| text == b"bronze"));
    for kind in [128, 129, 130, 131, 132, 134, 1000] {
        let kept = copy(&[Kind::new(kind)]).unwrap();
        let mut expected = sections.clone();
        expected.retain(|(other, _)| *other != kind);
        assert_eq!(sections_of(&kept), expected);
    }
    // One that is not there is left out without a word.
    assert_eq!(copy(&[Kind::new(999)]).unwrap(), bytes);
    let bare = copy(&[128, 129, 130, 131, 132, 134, 1000].map(Kind::new)).unwrap();
    assert_eq!(sections_of(&bare), sections[..2]);
    for kind in [Kind::PATTERN, Kind::DESCENT, Kind::RIDGE, Kind::new(5)] {
        let error = copy(&[Kind::NOISE, kind]).unwrap_err();
        assert_eq!(error, RecipeError::Required(kind));
    }
    for length in 0..bytes.len() {
        let error = recipe.copy_without(&[], &mut vec![0; length]).unwrap_err();
        assert_eq!(error, RecipeError::BufferTooSmall);
    }
}

#[test]
fn a_buffer_that_is_too_small_for_a_section_is_an_error() {
    let whole = written(&full()).unwrap();
    for length in 0..whole.len() {
        let error = Recipe::write(&full(), &mut vec![0; length]).unwrap_err();
        assert_eq!(error, RecipeError::BufferTooSmall);
    }
    assert!(Recipe::write(&full(), &mut vec![0; whole.len()]).is_ok());
}

/// A list that promises more materials than there are ends where its bytes end, at once.
#[test]
fn a_list_of_four_billion_materials_is_refused() {
    let mut sections = sections_of(&written(&full()).unwrap());
    sections[6].1.splice(0..1, [0xFF, 0xFF, 0xFF, 0xFF, 0x0F]);
    assert_eq!(refusal(&sections), RecipeError::Section(Kind::MATERIALS));
}

/// The statement `training` of a recipe with these bytes in its section.
fn training_of(bytes: Vec<u8>) -> Result<Vec<u8>, RecipeError> {
    let mut sections = sections_of(&written(&full()).unwrap());
    let last = sections.last_mut().unwrap();
    assert_eq!(last.0, Kind::TRAINING.number());
    last.1 = bytes;
    let bytes = recipe_of(&sections);
    let training = Recipe::parse(&bytes)?.statements()?.training.unwrap();
    written(&Ingredients {
        training: Some(training),
        ..full()
    })
}

#[test]
fn every_variant_of_training_is_read_as_it_was_written() {
    let all = sections_of(&written(&full()).unwrap());
    let bytes = &all.last().unwrap().1;
    // The first four bytes are the numbers of schedule, effort, parts and split.
    for (field, variants) in [(0, 3), (1, 4), (2, 4), (3, 4)] {
        for number in 0..=u8::MAX {
            let mut bytes = bytes.clone();
            bytes[field] = number;
            match training_of(bytes.clone()) {
                // Written again, it has the same bytes.
                Ok(again) => {
                    assert!(number < variants, "{field}");
                    assert_eq!(sections_of(&again).last().unwrap().1, bytes);
                }
                Err(error) => {
                    assert!(number >= variants, "{field}");
                    assert_eq!(error, RecipeError::Section(Kind::TRAINING));
                }
            }
        }
    }
    let none = Training {
        sources: TrainingSources::new(&[]),
        ..TRAINING
    };
    let bytes = written(&Ingredients {
        training: Some(none),
        ..full()
    });
    let bytes = bytes.unwrap();
    let statements = Recipe::parse(&bytes).unwrap().statements().unwrap();
    assert_eq!(statements.training, Some(none));
    assert_ne!(statements.training, Some(TRAINING));
}

#[test]
fn a_share_of_training_is_a_number_from_0_to_1() {
    for (share, error) in [
        (f32::NAN, RecipeError::NonFinite(Field::Share)),
        (f32::INFINITY, RecipeError::NonFinite(Field::Share)),
        (-1e-9, RecipeError::Negative(Field::Share)),
        (1.001, RecipeError::Range(Field::Share)),
    ] {
        let mut sources = SOURCES;
        sources[1].share = share;
        let training = Training {
            sources: TrainingSources::new(&sources),
            ..TRAINING
        };
        let refused = written(&Ingredients {
            training: Some(training),
            ..full()
        });
        assert_eq!(refused, Err(error));
    }
}

#[test]
fn a_list_of_sources_that_is_not_whole_is_refused() {
    let all = sections_of(&written(&full()).unwrap());
    let whole = &all.last().unwrap().1;
    // Four enums, and a digest of ten bytes.
    let count = 4 + 10;
    assert_eq!(whole[count], 3);
    let refused = Err(RecipeError::Section(Kind::TRAINING));
    for more in [4, 5, 127] {
        let mut bytes = whole.clone();
        bytes[count] = more;
        assert_eq!(training_of(bytes), refused);
    }
    // Four billion of them, which end at once.
    let mut bytes = whole.clone();
    bytes.splice(count..=count, [0xFF, 0xFF, 0xFF, 0xFF, 0x0F]);
    assert_eq!(training_of(bytes), refused);
    // Fewer, with bytes that are left over.
    let mut bytes = whole.clone();
    bytes[count] = 2;
    assert_eq!(training_of(bytes), refused);
    // An origin that is unknown: it follows the length and the text of the label.
    let mut bytes = whole.clone();
    let origin = count + 2 + SOURCES[0].label.len();
    assert_eq!(bytes[origin], 0);
    bytes[origin] = 2;
    assert_eq!(training_of(bytes), refused);
}

proptest! {
    #[test]
    fn a_section_of_noise_is_refused_by_its_kind_or_makes_sense(
        which in 0..8usize,
        noise in prop::collection::vec(any::<u8>(), 0..80),
    ) {
        let mut sections = sections_of(&written(&full()).unwrap());
        sections[which].1 = noise;
        let bytes = recipe_of(&sections);
        match Recipe::parse(&bytes) {
            Ok(recipe) => {
                if let Ok(Statements { materials, training, .. }) = recipe.statements() {
                    prop_assert_eq!(materials.count(), materials.len());
                    let sources = training.map(|training| training.sources);
                    prop_assert!(sources.is_none_or(|sources| sources.count() == sources.len()));
                } else {
                    prop_assert!(which >= 2, "no statement");
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
    fn materials_of_any_name_are_read(names in prop::collection::vec((".{0,40}", any::<u32>()), 0..30)) {
        let list: Vec<(&str, u32)> = names.iter().map(|(name, digest)| (&name[..], *digest)).collect();
        let bytes = written(&Ingredients { materials: &list, ..full() }).unwrap();
        let recipe = Recipe::parse(&bytes).unwrap();
        prop_assert!(recipe.statements().unwrap().materials.eq(list.iter().copied()));
    }
}

/// A recipe of a trained size is not much longer than its numbers.
#[test]
fn sections_cost_little() {
    let bytes = write(&neural()).unwrap();
    let numbers = 4 * (24 + 2 * 675);
    assert!(bytes.len() < numbers + 100, "{}", bytes.len());
}
