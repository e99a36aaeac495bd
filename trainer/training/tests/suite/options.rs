//! The options of a training: each one changes the training or is refused, alone and beside each other.

use clap::{Args, Command, FromArgMatches};
use glimpse_fitting::recipe::options::{OptionsError, Schedule, TrainingOptions};
use glimpse_materials::{Identity, Origin, Source, SourceShare};
use glimpse_training::run::{TrainError, check};

/// A value for each option that differs from its default.
const VALUES: [&str; 17] = [
    "--effort=long",
    "--schedule=paper",
    "--share=3,1",
    "--missing=0.3",
    "--noise=0.02",
    "--additive=0.01",
    "--levels=64",
    "--procedural=0.1",
    "--max-theta-i=60",
    "--max-theta-o=70",
    "--min-separation=20",
    "--in-plane",
    "--scan-seconds=40",
    "--speed=5",
    "--settle=2",
    "--bases=3",
    "--eta=10",
];

fn parse(words: &[&str]) -> TrainingOptions {
    let command = TrainingOptions::augment_args(Command::new("train").no_binary_name(true));
    let matches = command.try_get_matches_from(words).expect("options");
    TrainingOptions::from_arg_matches(&matches).expect("options")
}

/// Returns the identity of a training with two sources; None if the options are refused.
fn effect(words: &[&str]) -> Option<u64> {
    let mut options = parse(words);
    match check(&options) {
        Err(TrainError::Options(OptionsError::NoEffect { name, .. })) => {
            let is_named = |word: &&str| word[2..].starts_with(&name.replace('_', "-")[..3]);
            assert!(words.iter().any(is_named), "{name}: {words:?}");
            return None;
        }
        Err(TrainError::Options(OptionsError::Samples(0))) => return None,
        checked => checked.expect("options that are valid for themselves"),
    }
    let shares = match options.share[..] {
        [] => vec![0.5, 0.5],
        _ => vec![0.75, 0.25],
    };
    let sources = shares.into_iter().map(|share| SourceShare {
        share,
        ..SourceShare::single(&Source("procedural:12".into()), 12)
    });
    options.source_shares = sources.collect();
    Some(options.identity(&[]).options)
}

#[test]
fn each_option_changes_the_training_or_is_refused_beside_each_other() {
    let mut accepted = [false; VALUES.len()];
    for base in [
        ["--model=linear", "--samples=4"],
        ["--model=linear", "--samples=any"],
        ["--model=phong", "--samples=4"],
    ] {
        let effect = |options: &[&str]| effect(&[&base, options].concat());
        let none = effect(&[]);
        assert!(none.is_some());
        for (index, one) in VALUES.iter().enumerate() {
            let alone = effect(&[one]);
            assert_ne!(alone, none, "{one}");
            for other in VALUES.iter().filter(|other| *other != one) {
                let both = effect(&[one, other]);
                assert!(
                    both.is_none() || both != effect(&[other]),
                    "{one} beside {other}, {base:?}"
                );
                accepted[index] |= both.is_some();
            }
        }
    }
    assert!(!accepted.contains(&false), "{accepted:?}");
    // Defaults that are given are the same training.
    let plain = ["--model=phong", "--samples=4"];
    let given = [&plain[..], &["--missing=0", "--eta=40"]].concat();
    assert_eq!(effect(&given), effect(&plain));
}

#[test]
fn identity_depends_on_materials() {
    let material = |name: &str, digest| Identity {
        name: name.into(),
        digest,
    };
    let options = parse(&["--model=phong", "--samples=4"]);
    let identity = options.identity(&[material("brass", 1), material("felt", 2)]);
    for other in [
        [material("brass", 1), material("felt", 3)],
        [material("brass", 1), material("silk", 2)],
        [material("felt", 2), material("brass", 1)],
    ] {
        let other = options.identity(&other);
        assert_ne!(identity.materials, other.materials);
        assert_eq!(identity.options, other.options);
    }
}

#[test]
fn shares_of_sources_include_procedural_materials() {
    let mut options = parse(&["--model=phong", "--samples=4"]);
    assert!(options.sources().is_empty());
    let source = |text: &str, share| SourceShare {
        share,
        ..SourceShare::single(&Source(text.into()), 12)
    };
    options.source_shares = vec![source("MERL", 0.25), source("procedural:12", 0.75)];
    let shares = |options: &TrainingOptions| -> Vec<(Origin, f32)> {
        let sources = options.sources().into_iter();
        sources
            .map(|source| (source.origin, source.share))
            .collect()
    };
    assert_eq!(
        shares(&options),
        [
            (Origin::Files, 0.15),
            (Origin::BuiltIn, 0.450_000_02),
            (Origin::BuiltIn, 0.4)
        ]
    );
    options.schedule = Schedule::Paper;
    assert_eq!(
        shares(&options),
        [(Origin::Files, 0.25), (Origin::BuiltIn, 0.75)]
    );
}
