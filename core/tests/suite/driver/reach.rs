//! Samples out of reach are detected before any move, and skipped or reported.

use glimpse_core::driver::{Action, Config, Host};
use glimpse_core::gonio::Limits;
use glimpse_core::link::{Failure, Request};
use glimpse_core::recipe::Recipe;

use super::bench::{Bench, is_failed, is_finished, is_measure, is_saved, new_driver};
use super::missing::{fit_bits, fitted_bits, tolerant_recipes};
use crate::scanning::{Any, MODELS, full_scan, new_scan, recipe_for, record, synthetic_reading};

const HOSTS: [Host; 3] = [Host::Measures, Host::Listens, Host::Absent];

/// The indices within reach and out of reach.
fn split(recipe: &Recipe<'_>, limits: &Limits) -> (Vec<u16>, Vec<u16>) {
    let (within, out): (Vec<_>, Vec<_>) = recipe
        .directions()
        .partition(|(_, directions)| limits.check(directions).is_ok());
    let indices = |samples: Vec<(u16, _)>| samples.into_iter().map(|(index, _)| index).collect();
    (indices(within), indices(out))
}

/// Limits that exclude some samples of a recipe, but not all.
fn partial_limits(recipe: &Recipe<'_>) -> Limits {
    let limits = (1..157).map(|step| Limits {
        max_theta_i: 0.01 * step as f32,
        ..Limits::NONE
    });
    let mut limits = limits.filter(|limits| {
        let (within, out) = split(recipe, limits);
        within.len() >= 2 && out.len() >= 2
    });
    limits.next().unwrap()
}

fn config(host: Host, limits: Limits) -> Config {
    let mut config = Config::new(host);
    config.limits = Some(limits);
    config
}

fn is_end(action: &Action) -> bool {
    is_finished(action) || is_failed(action)
}

#[test]
fn out_of_reach_fails_before_any_move() {
    for model in MODELS {
        let recipe = recipe_for(model);
        let limits = partial_limits(&recipe);
        let (_, out) = split(&recipe, &limits);
        let (index, count) = (out[0], out.len() as u16);
        let failure = Failure::OutOfReach { index, count };
        for host in HOSTS {
            let mut driver = new_driver::<Any>(recipe, config(host, limits));
            let mut bench = Bench::cooperative();
            bench.sensor = Box::new(|index| panic!("{index} was read"));
            let (_, failed) = bench.run(&mut driver, is_end);
            assert_eq!(failed, Action::Failed(failure));
            assert_eq!(bench.count(is_measure), 0);
            if host != Host::Absent {
                bench.wait(&mut driver, 100);
                let report = Request::Failed(failure.into());
                assert_eq!(bench.requests.last(), Some(&report));
            }
        }
    }
}

#[test]
fn tolerant_recipe_skips_samples_out_of_reach() {
    for recipe in tolerant_recipes() {
        let limits = partial_limits(&recipe);
        let (within, out) = split(&recipe, &limits);
        let expected = fit_bits(recipe, within.iter().copied());
        for host in HOSTS {
            let mut driver = new_driver::<Any>(recipe, config(host, limits));
            let mut bench = Bench::cooperative();
            bench.sensor = Box::new(|index| {
                assert!(!out.contains(&index));
                synthetic_reading(index)
            });
            for _ in 0..2 {
                bench.run(&mut driver, is_end);
                assert_eq!(fitted_bits(&driver), expected);
                if host == Host::Measures {
                    let measured: Vec<_> = std::mem::take(&mut bench.requests)
                        .into_iter()
                        .filter_map(|request| match request {
                            Request::Measure { index, .. } => Some(index),
                            _ => None,
                        })
                        .collect();
                    assert_eq!(measured, within);
                }
                driver.restart();
            }
        }
    }
}

/// A scan without any sample within reach has no readings to fit.
#[test]
fn no_sample_within_reach_fails() {
    let limits = Limits {
        max_theta_i: 1e-3,
        ..Limits::NONE
    };
    for recipe in tolerant_recipes() {
        let mut driver = new_driver::<Any>(recipe, config(Host::Measures, limits));
        let mut bench = Bench::cooperative();
        let (index, count) = (0, 6);
        let failure = Failure::OutOfReach { index, count };
        assert_eq!(bench.run(&mut driver, is_end).1, Action::Failed(failure));
        assert_eq!(bench.count(is_measure), 0);
    }
}

#[test]
fn unlimited_reach_excludes_nothing() {
    for model in MODELS {
        let recipe = recipe_for(model);
        let mut driver = new_driver::<Any>(recipe, config(Host::Measures, Limits::NONE));
        let mut bench = Bench::cooperative();
        bench.run(&mut driver, is_end);
        assert_eq!(
            bench.results().0,
            full_scan::<Any>(recipe, synthetic_reading).bits()
        );
    }
}

/// A saved reading needs no move. If the host refuses it, its sample is out of reach.
#[test]
fn saved_reading_out_of_reach_is_used() {
    for recipe in tolerant_recipes() {
        let limits = partial_limits(&recipe);
        let (within, out) = split(&recipe, &limits);
        for is_valid in [true, false] {
            let mut scan = new_scan::<Any>(recipe);
            let saved = |index| synthetic_reading(if is_valid { index } else { 7 });
            record(&mut scan, [out[0]], saved);
            let config = config(Host::Measures, limits);
            let mut driver = glimpse_core::driver::Driver::new(scan, config);
            let mut bench = Bench::cooperative();
            bench.run(&mut driver, is_end);
            let of_saved = out.iter().copied().take(usize::from(is_valid));
            let read = within.iter().copied().chain(of_saved);
            assert_eq!(fitted_bits(&driver), fit_bits(recipe, read));
            assert_eq!(bench.count(is_saved), 1);
        }
    }
}
