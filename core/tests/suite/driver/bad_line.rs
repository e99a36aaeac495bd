//! A line that loses, doubles and alters bytes costs time and nothing else.

use glimpse_core::driver::{Action, Config, Host};
use glimpse_core::link::Failure;
use glimpse_core::model::ModelKind;

use super::bench::{Bench, driver_by, is_failed, is_finished, is_measure};
use super::update::{is_installed, offers, stored};
use crate::random::Random;
use crate::recipes::parsed;
use crate::scanning::{Any, MODELS, bytes_of, material, recipe_of, whole};

fn scan_over_a_bad_line(model: ModelKind, host: Host, odds: u64) {
    let recipe = recipe_of(model);
    let expected = whole::<Any>(recipe, material);
    let mut time = 0;
    for seed in 0..10 {
        let mut driver = driver_by::<Any>(recipe, Config::new(host));
        let mut bench = Bench::willing();
        let mut random = Random(seed);
        bench.spoil = Box::new(move |bytes| random.spoil(bytes, odds));
        bench.run(&mut driver, is_finished);
        let (bits, ends) = bench.results();
        assert_eq!(bits, expected.bits());
        // Every failure was a silence, after which the scan went on.
        let actions = bench.take_actions();
        let failed = actions.iter().filter(|action| is_failed(action)).count();
        let silence = Action::Failed(Failure::NoReply);
        let silences = actions.iter().filter(|action| **action == silence).count();
        assert_eq!(failed, silences);
        assert!(ends <= failed + 1);
        assert!(!actions.contains(&Action::Forget));
        // No reading was asked for twice, however often the host fell silent.
        let asked = if host == Host::Measures { 8 } else { 0 };
        assert_eq!(bench.count(is_measure), asked);
        time += bench.now;
    }
    assert!(time > 0, "nothing was spoiled");
}

#[test]
fn a_bad_line_ends_in_the_same_bits() {
    for host in [Host::Measures, Host::Listens] {
        for model in MODELS {
            scan_over_a_bad_line(model, host, 200);
            scan_over_a_bad_line(model, host, 50);
        }
    }
}

#[test]
fn a_recipe_comes_whole_over_a_bad_line() {
    let offered = bytes_of(ModelKind::Neural);
    let checksum = parsed(offered.clone()).checksum();
    for seed in 0..5 {
        let mut config = Config::new(Host::Measures);
        config.recipe_bytes = 8_192;
        let mut driver = driver_by::<Any>(recipe_of(ModelKind::Linear), config);
        let mut bench = offers(&offered, checksum);
        let mut random = Random(seed);
        bench.spoil = Box::new(move |bytes| random.spoil(bytes, 150));
        bench.run(&mut driver, is_installed);
        assert_eq!(stored(&bench.take_actions()), offered);
    }
}
