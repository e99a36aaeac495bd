//! A line that loses, doubles and alters bytes costs time and nothing else.

use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::fit::{AnyModel, Fitter};
use glimpse_core::link::{Failure, Reply, Request};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Memory, Scan};

use super::bench::{Bench, answer};
use super::scanning::{SAMPLES, WORDS, every_fitter, material, recipe_of, whole};

/// SplitMix64.
struct Random(u64);

impl Random {
    fn below(&mut self, bound: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % bound
    }
}

/// One byte in `odds` is lost, altered, doubled, swapped with the one before it, or invented, or the
/// rest is cut; one block of bytes in ten does not come, or comes twice.
fn spoiler(seed: u64, odds: u64) -> impl FnMut(Vec<u8>) -> Vec<u8> {
    let mut random = Random(seed);
    move |bytes| {
        let bytes = match random.below(20) {
            0 => return Vec::new(),
            1 => bytes.repeat(2),
            _ => bytes,
        };
        let mut spoiled = Vec::new();
        for byte in bytes {
            if random.below(odds) > 0 {
                spoiled.push(byte);
                continue;
            }
            match random.below(6) {
                0 => {}
                1 => spoiled.push(byte ^ (1 << random.below(8))),
                2 => spoiled.extend([byte; 2]),
                3 => spoiled.insert(spoiled.len().saturating_sub(1), byte),
                4 => spoiled.extend([random.below(256) as u8, byte]),
                _ => break,
            }
        }
        spoiled
    }
}

fn scan_over_a_bad_line<K: Fitter>(recipe: Recipe<'_>, host: Host, odds: u64) {
    let expected = whole::<K>(recipe, material);
    let mut time = 0;
    for seed in 0..10 {
        let mut memory = Memory::<K, SAMPLES>::new();
        let scan = Scan::new(recipe, &mut memory).unwrap();
        let mut driver = Driver::new(Ok(scan), Config::new(host));
        let mut bench = Bench::willing();
        bench.spoil = Box::new(spoiler(seed, odds));
        bench.run(&mut driver, |action| matches!(action, Action::Finished(_)));
        let (bits, ends) = bench.told();
        assert_eq!(bits, expected.bits());
        // Whatever failed was a silence, after which the scan went on.
        let actions = bench.take_actions();
        let failed = actions.iter().filter_map(|action| match action {
            Action::Failed(failure) => Some(failure),
            _ => None,
        });
        let failed: Vec<_> = failed.collect();
        assert!(failed.iter().all(|failure| **failure == Failure::NoReply));
        assert!(ends <= failed.len() + 1);
        assert!(!actions.contains(&Action::Forget));
        // No reading was asked for twice, however often the host fell silent.
        let measured = |request: &&Request| matches!(request, Request::Measure { .. });
        let asked = if host == Host::Measures { 8 } else { 0 };
        assert_eq!(bench.heard.iter().filter(measured).count(), asked);
        time += bench.now;
    }
    assert!(time > 0, "nothing was spoiled");
}

#[test]
fn a_bad_line_ends_in_the_same_bits() {
    for host in [Host::Measures, Host::Listens] {
        every_fitter!(scan_over_a_bad_line, host, 200);
        every_fitter!(scan_over_a_bad_line, host, 50);
    }
}

#[test]
fn a_recipe_comes_whole_over_a_bad_line() {
    let present = recipe_of(ModelKind::Linear);
    let offered = recipe_of(ModelKind::Neural);
    let checksum = Recipe::parse(&offered).unwrap().checksum();
    for seed in 0..5 {
        let mut memory = Memory::<AnyModel<WORDS>, SAMPLES>::new();
        let scan = Scan::new(Recipe::parse(&present).unwrap(), &mut memory).unwrap();
        let config = Config {
            recipe_bytes: 8_192,
            ..Config::new(Host::Measures)
        };
        let mut driver = Driver::new(Ok(scan), config);
        let mut bench = Bench::new(|request| match request {
            Request::Update => Some(Reply::Recipe {
                bytes: offered.len() as u32,
                checksum,
            }),
            Request::RecipePart { offset } => Some(super::update::part(&offered, *offset)),
            _ => Some(answer(request)),
        });
        bench.spoil = Box::new(spoiler(seed, 150));
        bench.run(&mut driver, |action| {
            matches!(action, Action::Install { .. })
        });
        assert_eq!(super::update::stored(&bench.take_actions()), offered);
    }
}
