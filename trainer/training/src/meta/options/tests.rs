//! Tests of the options.

use std::collections::HashSet;

use super::*;
use glimpse_materials::Source;

fn set_pattern_only(options: &mut Options, first: f32) {
    options.parts = TrainedParts::PatternOnly;
    options.pretrained = Some(PretrainedInit {
        initial: vec![first; 7],
        step_sizes: vec![0.5; 7],
    });
}

fn set_paper(options: &mut Options, components: usize, eta: f32) {
    options.schedule = Schedule::Paper;
    options.prior = Prior { components, eta };
}

fn options(model: ModelKind, schedule: Schedule) -> Options {
    let source = |text: &str, share| SourceShare {
        share,
        ..SourceShare::single(&Source(text.into()), 12)
    };
    Options {
        source_shares: vec![source("MERL", 0.25), source("procedural:12", 0.75)],
        ..Options::new(model, 8, schedule, Effort::Quick, 0)
    }
}

type Change = fn(&mut Options);

#[test]
fn effective_options_change_digest() {
    let changes: &[Change] = &[
        |_| {},
        |o| o.model = ModelKind::Neural,
        |o| o.samples = 9,
        |o| o.schedule = Schedule::Paper,
        |o| o.effort = Effort::Long,
        |o| o.parts = TrainedParts::AllTwice,
        |o| set_pattern_only(o, 0.5),
        |o| set_pattern_only(o, 0.25),
        |o| set_paper(o, 6, 40.0),
        |o| set_paper(o, 5, 41.0),
        |o| o.completion_options.missing = 0.5,
        |o| o.completion_options.noise = 0.02,
        |o| o.completion_options.additive = 0.02,
        |o| o.completion_options.levels = 20,
        |o| o.completion_options.procedural = 0.5,
        |o| o.completion_options.limits.max_theta_i = 1.25,
        |o| o.completion_options.limits.max_theta_o = 1.25,
        |o| o.completion_options.limits.min_separation = 0.25,
        |o| o.completion_options.limits.in_plane = true,
        |o| o.fixed.push(Angles::default()),
        |o| o.source_shares.clear(),
        |o| o.source_shares.reverse(),
        |o| o.source_shares[0].label = "RGL".into(),
        |o| o.source_shares[0].origin = Origin::BuiltIn,
        |o| o.source_shares[0].materials = 13,
        |o| o.source_shares[0].share = 0.5,
        |o| o.seed = 1,
    ];
    let digests: HashSet<u64> = changes
        .iter()
        .map(|change| {
            let mut options = options(ModelKind::Linear, Schedule::Prior);
            change(&mut options);
            options.digest()
        })
        .collect();
    assert_eq!(digests.len(), changes.len());
}

#[test]
fn identity_depends_on_options_and_materials() {
    let material = |name: &str, digest| Identity {
        name: name.into(),
        digest,
    };
    let options = options(ModelKind::Phong, Schedule::Prior);
    let identity = options.identity(&[material("brass", 1), material("felt", 2)]);
    assert_eq!(identity.options, options.digest());
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
fn source_shares_sum_to_one() {
    for (schedule, shares) in [
        (Schedule::Paper, &[0.25, 0.75][..]),
        (Schedule::Prior, &[0.15, 0.45, 0.4]),
    ] {
        let options = options(ModelKind::Phong, schedule);
        let sources = options.sources();
        assert_eq!(sources.len(), shares.len());
        for (source, share) in sources.iter().zip(shares) {
            assert!((source.share - share).abs() < 1e-6, "{source:?}");
        }
        assert_eq!(sources[0].origin, Origin::Files);
        let others = &sources[1..];
        assert!(others.iter().all(|each| each.origin == Origin::BuiltIn));
    }
    let (count, seed) = CompletionOptions::PROCEDURAL_SET;
    let label = format!("procedural:{count}:{seed}");
    assert_eq!(CompletionOptions::PROCEDURAL_LABEL, label);
    let unknown = Options {
        source_shares: Vec::new(),
        ..options(ModelKind::Phong, Schedule::Prior)
    };
    assert!(unknown.sources().is_empty());
}
