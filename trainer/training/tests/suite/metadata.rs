//! The metadata of a recipe: a round trip, and errors of damaged ones.

use glimpse_core::geometry::{Angles, Arms};
use glimpse_core::model::ModelKind;
use glimpse_fitting::recipe::expected_loss::{LossEstimate, ValidatedLoss, ValidationSplit};
use glimpse_fitting::recipe::options::{Effort, OptionsError, Schedule, TrainingOptions};
use glimpse_fitting::recipe::{Metadata, MetadataError, Training};
use glimpse_fitting::route::{LimitArgs, SpeedArgs};
use glimpse_materials::{Identity, Origin, SourceShare};
use proptest::prelude::*;

/// Metadata with all fields.
fn full() -> Metadata {
    let source = |label: &str, origin, share| SourceShare {
        label: label.to_owned(),
        origin,
        materials: 100,
        share,
    };
    let options = TrainingOptions {
        source_shares: vec![
            source("MERL", Origin::Files, 0.0),
            source("", Origin::BuiltIn, 1.0),
        ],
        share: vec![0.5, 3.0],
        missing: Some(0.5),
        noise: 0.05,
        additive: 1e-4,
        levels: 4096,
        limits: LimitArgs {
            max_theta_i: Some(75.0),
            min_separation: Some(5.0),
            in_plane: true,
            ..LimitArgs::default()
        },
        scan_seconds: Some(60.0),
        speeds: SpeedArgs {
            speed: Some(Arms::from_array([20.0, 0.0, 10.0, 0.0])),
            settle: Some(0.1),
        },
        ..TrainingOptions::new(
            ModelKind::Linear,
            12,
            Schedule::Prior,
            Effort::Standard,
            u64::MAX,
        )
    };
    Metadata {
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
            options,
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
    let changes: [(&str, Change); 3] = [
        ("expected_loss.loss", |metadata, value| {
            metadata.expected_loss.as_mut().unwrap().estimate.loss = value;
        }),
        ("expected_loss.standard_error", |metadata, value| {
            let expected = metadata.expected_loss.as_mut().unwrap();
            expected.estimate.standard_error = Some(value);
        }),
        ("training.options.source_shares.share", |metadata, value| {
            let training = metadata.training.as_mut().unwrap();
            training.options.source_shares[1].share = value;
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
}

/// Options of metadata are checked as those of a training are.
#[test]
fn error_names_invalid_option() {
    type Change = fn(&mut TrainingOptions);
    let changes: [(&str, Change); 6] = [
        ("noise", |options| options.noise = f32::NAN),
        ("scan_seconds", |options| options.scan_seconds = Some(-1.0)),
        ("settle_seconds", |options| {
            options.speeds.settle = Some(f64::INFINITY);
        }),
        ("speed", |options| {
            options.speeds.speed = Some(Arms::from_array([-0.5; 4]));
        }),
        ("max_theta_i_degrees", |options| {
            options.limits.max_theta_i = Some(1e3);
        }),
        // An option without effect: such metadata were not written by a training.
        ("eta", |options| options.eta = 1.0),
    ];
    for (name, change) in changes {
        let mut damaged = full();
        change(&mut damaged.training.as_mut().unwrap().options);
        let error = decoding_error(&damaged);
        assert!(matches!(error, MetadataError::Options(_)), "{error}");
        assert!(error.to_string().contains(name), "{error}");
    }
    let mut damaged = full();
    let options = &mut damaged.training.as_mut().unwrap().options;
    (options.scan_seconds, options.speeds) = (None, SpeedArgs::default());
    options.pattern = vec![Angles::from_array([1.5, 1.5, 0.0])];
    let error = decoding_error(&damaged);
    assert!(
        matches!(
            error,
            MetadataError::Options(OptionsError::FixedReach { row: 1, .. })
        ),
        "{error}"
    );
}

#[test]
fn damaged_bytes_are_refused() {
    let bytes = full().to_bytes();
    let damaged = |bytes: &[u8]| Metadata::from_bytes(bytes) == Err(MetadataError::Encoding);
    for length in 1..bytes.len() {
        assert!(damaged(&bytes[..length]), "{length}");
    }
    assert!(damaged(&[&bytes[..], &[0; 3]].concat()));
    // A list of four billion materials.
    assert!(damaged(&[0, 0, 0xff, 0xff, 0xff, 0xff, 0x0f]));
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
