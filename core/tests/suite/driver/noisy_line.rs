//! A line that loses, doubles and alters bytes only costs time.

use glimpse_core::driver::{Action, Config, Host};
use glimpse_core::link::Failure;
use glimpse_core::model::ModelKind;

use super::bench::{Bench, is_failed, is_finished, is_measure, new_driver};
use super::recipe_update::{is_installed, offering_host, stored_bytes};
use crate::random::Random;
use crate::recipes::parsed;
use crate::scanning::{Any, MODELS, encoded_recipe, full_scan, recipe_for, synthetic_reading};

fn scan_over_noisy_line(model: ModelKind, host: Host, odds: u64) {
    let recipe = recipe_for(model);
    let expected = full_scan::<Any>(recipe, synthetic_reading);
    let mut time = 0;
    for seed in 0..10 {
        let mut driver = new_driver::<Any>(recipe, Config::new(host));
        let mut bench = Bench::cooperative();
        let mut random = Random(seed);
        bench.corrupt = Box::new(move |bytes| random.corrupt(bytes, odds));
        bench.run(&mut driver, is_finished);
        let (bits, ends) = bench.results();
        assert_eq!(bits, expected.bits());
        // Every failure was a timeout, after which the scan continued.
        let actions = bench.take_actions();
        let failed = actions.iter().filter(|action| is_failed(action)).count();
        let timeout = Action::Failed(Failure::NoReply);
        let timeouts = actions.iter().filter(|action| **action == timeout).count();
        assert_eq!(failed, timeouts);
        assert!(ends <= failed + 1);
        assert!(!actions.contains(&Action::Forget));
        // No reading was requested twice, despite the timeouts.
        let requested = if host == Host::Measures { 8 } else { 0 };
        assert_eq!(bench.count(is_measure), requested);
        time += bench.now;
    }
    assert!(time > 0, "no byte was corrupted");
}

#[test]
fn noisy_line_keeps_result() {
    for host in [Host::Measures, Host::Listens] {
        for model in MODELS {
            scan_over_noisy_line(model, host, 200);
            scan_over_noisy_line(model, host, 50);
        }
    }
}

#[test]
fn noisy_line_transfers_recipe() {
    let offered = encoded_recipe(ModelKind::Neural);
    let checksum = parsed(offered.clone()).checksum();
    for seed in 0..5 {
        let mut config = Config::new(Host::Measures);
        config.recipe_bytes = 8_192;
        let mut driver = new_driver::<Any>(recipe_for(ModelKind::Linear), config);
        let mut bench = offering_host(&offered, checksum);
        let mut random = Random(seed);
        bench.corrupt = Box::new(move |bytes| random.corrupt(bytes, 150));
        bench.run(&mut driver, is_installed);
        assert_eq!(stored_bytes(&bench.take_actions()), offered);
    }
}
