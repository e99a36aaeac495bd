//! The metadata of a recipe: a round trip, and an error that names each damaged field.

use glimpse_core::gonio::Limits;
use glimpse_materials::{Identity, Origin, SourceShare};
use glimpse_training::meta::expected_loss::{LossEstimate, ValidatedLoss, ValidationSplit};
use glimpse_training::meta::plan::TrainedParts;
use glimpse_training::meta::plan::{Effort, Schedule};
use glimpse_training::meta::scan_budget::ScanBudget;
use glimpse_training::meta::tasks::task::Noise;
use glimpse_training::recipe::{Metadata, MetadataError, Training};
use glimpse_training::route::Axes;
use proptest::prelude::*;

/// Metadata with all fields.
fn full() -> Metadata {
    let source = |label: &str, origin, share| SourceShare {
        label: label.to_owned(),
        origin,
        materials: 100,
        share,
    };
    Metadata {
        limits: Some(Limits {
            max_theta_i: 1.3,
            max_theta_o: 1.4,
            min_separation: 0.1,
            in_plane: true,
        }),
        noise: Some(Noise {
            multiplicative: 0.05,
            additive: 1e-4,
            levels: 4096,
        }),
        scan_budget: Some(ScanBudget {
            seconds: 60.0,
            speeds: Axes::from_array([20.0, 0.0, 10.0, 90.0]),
            settle: 0.1,
        }),
        expected_loss: Some(ValidatedLoss {
            estimate: LossEstimate {
                loss: 0.0125,
                standard_error: Some(0.0015),
                materials: 10,
            },
            split: ValidationSplit::Folds,
        }),
        training: Some(Training {
            trainer: "a trainer".to_owned(),
            data: "Stoff für Bühnen".to_owned(),
            materials: 100,
            sources: vec![
                source("MERL", Origin::Files, 0.0),
                source("", Origin::BuiltIn, 1.0),
            ],
            schedule: Schedule::Prior,
            effort: Effort::Standard,
            parts: TrainedParts::PatternOnly,
            options: String::new(),
            seed: u64::MAX,
            digest: u64::MAX,
        }),
        materials: [("alum-bronze", 1), ("", u32::MAX)]
            .map(|(name, digest)| Identity {
                name: name.to_owned(),
                digest,
            })
            .into(),
    }
}

fn decoding_error(metadata: &Metadata) -> MetadataError {
    Metadata::from_bytes(&metadata.to_bytes()).expect_err("invalid metadata")
}

#[test]
fn metadata_round_trip() {
    for metadata in [full(), Metadata::default()] {
        let bytes = metadata.to_bytes();
        assert_eq!(Metadata::from_bytes(&bytes), Ok(metadata));
    }
    assert!(Metadata::default().to_bytes().is_empty());
}

#[test]
fn error_names_invalid_number() {
    type Change = fn(&mut Metadata, f32);
    let changes: [(&str, Change); 8] = [
        ("noise.multiplicative", |metadata, value| {
            metadata.noise.as_mut().unwrap().multiplicative = value;
        }),
        ("noise.additive", |metadata, value| {
            metadata.noise.as_mut().unwrap().additive = value;
        }),
        ("scan_budget.speeds", |metadata, value| {
            metadata.scan_budget.as_mut().unwrap().speeds.phi_o = value.into();
        }),
        ("scan_budget.settle", |metadata, value| {
            metadata.scan_budget.as_mut().unwrap().settle = value.into();
        }),
        ("scan_budget.seconds", |metadata, value| {
            metadata.scan_budget.as_mut().unwrap().seconds = value.into();
        }),
        ("expected_loss.loss", |metadata, value| {
            metadata.expected_loss.as_mut().unwrap().estimate.loss = value;
        }),
        ("expected_loss.standard_error", |metadata, value| {
            let expected = metadata.expected_loss.as_mut().unwrap();
            expected.estimate.standard_error = Some(value);
        }),
        ("training.sources.share", |metadata, value| {
            metadata.training.as_mut().unwrap().sources[1].share = value;
        }),
    ];
    for (name, change) in changes {
        for value in [f32::NAN, f32::INFINITY, -0.5] {
            let mut damaged = full();
            change(&mut damaged, value);
            let error = decoding_error(&damaged);
            assert!(
                matches!(error, MetadataError::Range { field, .. } if field == name),
                "{name}: {error}"
            );
            assert!(error.to_string().contains(name), "{error}");
        }
    }
    let mut damaged = full();
    damaged.training.as_mut().unwrap().sources[0].share = 1.5;
    let text = decoding_error(&damaged).to_string();
    assert!(
        text.contains("training.sources.share") && text.contains("1.5"),
        "{text}"
    );
    // Degrees instead of radians.
    damaged.limits.as_mut().unwrap().max_theta_o = 75.0;
    assert_eq!(decoding_error(&damaged), MetadataError::Encoding("limits"));
}

#[test]
fn error_names_damaged_bytes() {
    let bytes = full().to_bytes();
    let mut names = Vec::new();
    for length in 1..bytes.len() {
        let error = Metadata::from_bytes(&bytes[..length]).expect_err("cut metadata");
        let MetadataError::Encoding(name) = error else {
            panic!("{length}: {error}");
        };
        names.push(name);
    }
    names.dedup();
    let fields = [
        "limits",
        "noise",
        "scan_budget",
        "expected_loss",
        "training",
        "materials",
    ];
    assert_eq!(names, fields);

    let padded = [&bytes[..], &[0; 3]].concat();
    assert_eq!(
        Metadata::from_bytes(&padded),
        Err(MetadataError::Trailing(3))
    );
    let other = [&[9], &bytes[1..]].concat();
    assert_eq!(Metadata::from_bytes(&other), Err(MetadataError::Version(9)));
    // A list of four billion materials.
    let long = [bytes[0], 0, 0, 0, 0, 0, 0xff, 0xff, 0xff, 0xff, 0x0f];
    assert_eq!(
        Metadata::from_bytes(&long),
        Err(MetadataError::Encoding("materials"))
    );
}

proptest! {
    #[test]
    fn altered_bytes_are_rejected_or_valid(index in 0..200_usize, byte in any::<u8>()) {
        let mut bytes = full().to_bytes();
        let index = index % bytes.len();
        bytes[index] = byte;
        if let Ok(metadata) = Metadata::from_bytes(&bytes) {
            prop_assert_eq!(Metadata::from_bytes(&metadata.to_bytes()), Ok(metadata));
        }
    }
}
