//! Full scans with a host that measures, with a host that listens, and without a host. The result has the bits of a
//! plain scan, whatever the order of the readings and the quality of the line.

use glimpse_core::driver::{Action, Config, Host};
use glimpse_core::error::ErrorCode;
use glimpse_core::link::{PROTOCOL, Request};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Evidence, Residual};

use super::bench::*;
use crate::random::Random;
use crate::scanning::*;

const HOSTS: [Host; 3] = [Host::Measures, Host::Listens, Host::Absent];
const IN_ORDER: [u16; 8] = [0, 1, 2, 3, 4, 5, 6, 7];

/// Runs two scans, and checks result, actions, and the kinds of requests.
fn check_scans(recipe: Recipe<'static>, host: Host, slice: u32) {
    let expected = full_scan(recipe, synthetic_reading);
    let mut config = Config::new(host);
    config.steps_per_poll = slice;
    let mut driver = new_driver(recipe, config);
    let mut bench = Bench::cooperative();
    for _ in 0..2 {
        bench.run(&mut driver, is_finished);
        assert_eq!(fitted_bits(&driver), expected.bits());
        bench.run(&mut driver, is_forget);
        let saves = IN_ORDER.map(|index| Action::Save {
            index,
            reading: Some(synthetic_reading(index)),
        });
        let evidence = Evidence {
            dark: Some(0.0),
            drift: Some(0.0),
            restored: 0,
        };
        let residual = Residual {
            evidence,
            ..expected.residual()
        };
        let end = [Action::Finished(residual), Action::Forget];
        assert_eq!(
            bench.take_actions(),
            Vec::from_iter(saves.into_iter().chain(end))
        );
        let measures = bench.count(is_measure);
        let total = if recipe.model() == ModelKind::Linear {
            41
        } else {
            185
        };
        match host {
            Host::Absent => assert!(bench.requests.is_empty() && bench.frames.is_empty()),
            _ => {
                let hello = Request::Hello {
                    protocol: PROTOCOL,
                    model: recipe.model(),
                    samples: 8,
                    recipe: recipe.checksum(),
                };
                assert_eq!(bench.requests[0], hello);
                assert_eq!(bench.results(), (expected.bits().to_vec(), 1));
                assert_eq!(measures, if host == Host::Measures { 8 } else { 0 });
                let slices = bench.count(|request| matches!(request, Request::Progress(_)));
                assert_eq!(slices as u32, u32::div_ceil(total, slice.max(1)));
            }
        }
        if host == Host::Measures {
            assert_eq!(bench.now, 0, "no time has passed");
        } else {
            // The material stays until the firmware begins the next scan.
            bench.wait(&mut driver, 100_000);
            assert_eq!(fitted_bits(&driver), expected.bits());
            driver.restart();
        }
        bench.requests.clear();
    }
}

#[test]
fn driver_matches_plain_scan() {
    for host in HOSTS {
        for model in MODELS {
            for slice in [0, 8, 1_000] {
                check_scans(recipe_for(model), host, slice);
            }
        }
    }
}

/// A line that loses, doubles and alters bytes only costs time: no reading is taken twice.
#[test]
fn noisy_line_keeps_result() {
    for host in [Host::Measures, Host::Listens] {
        for (model, odds) in MODELS
            .into_iter()
            .flat_map(|model| [(model, 200), (model, 50)])
        {
            let expected = full_scan(recipe_for(model), synthetic_reading);
            let mut time = 0;
            for seed in 0..5 {
                let mut driver = new_driver(recipe_for(model), Config::new(host));
                let mut bench = Bench::cooperative();
                let mut random = Random(seed);
                bench.corrupt = Box::new(move |bytes| random.corrupt(bytes, odds));
                loop {
                    let (_, action) =
                        bench.run(&mut driver, |action| is_forget(action) || is_failed(action));
                    match action {
                        Action::Failed(error) => {
                            assert_eq!(error.code, ErrorCode::NoReply);
                            driver.resume();
                        }
                        Action::Forget => break,
                        other => panic!("{other:?}"),
                    }
                }
                assert_eq!(bench.results().0, expected.bits());
                let measures = if host == Host::Measures { 8 } else { 0 };
                assert_eq!(bench.count(is_measure), measures);
                time += bench.now;
            }
            assert!(time > 0, "no byte was corrupted");
        }
    }
}

/// Retransmissions of a request neither drift nor accumulate. A hello to a host that measures has no timeout.
#[test]
fn retransmissions_are_on_time() {
    for period in [1_u32, 7, 99] {
        let mut config = Config::new(Host::Listens);
        config.reply_timeout_ms = 70_000;
        let mut driver = new_driver(recipe_for(ModelKind::Phong), config);
        let mut sent = Vec::new();
        for now in (0..70_000).step_by(period as usize) {
            assert_eq!(driver.poll(ORIGIN + now), Action::Wait);
            if !driver.outgoing().is_empty() {
                sent.push(now);
                driver.sent(1_000);
            }
            assert!((1..=100).contains(&driver.poll_delay(ORIGIN + now).unwrap()));
        }
        for (due, at) in (0..).step_by(100).zip(&sent) {
            assert!((due..due + u64::from(period)).contains(at), "{due}, {at}");
        }
        assert!(sent.len() > 690, "{}", sent.len());
    }
    let mut driver = new_driver(recipe_for(ModelKind::Phong), Config::new(Host::Measures));
    let mut bench = Bench::cooperative();
    bench.disconnected = true;
    bench.wait(&mut driver, 3_600_000);
    assert_eq!(bench.frames.len(), 36_001);
    bench.disconnected = false;
    bench.run(&mut driver, is_finished);
}

/// A frame that a slow line has not sent completely does not start again.
#[test]
fn unsent_frame_is_not_restarted() {
    let mut driver = new_driver(recipe_for(ModelKind::Phong), Config::new(Host::Measures));
    driver.poll(0);
    let frame = driver.outgoing().to_vec();
    let mut sent = Vec::new();
    for now in (0..).step_by(30).take(frame.len()) {
        driver.poll(now);
        sent.push(driver.outgoing()[0]);
        driver.sent(1);
    }
    assert_eq!(sent, frame);
    assert!(driver.outgoing().is_empty());
    driver.poll(100_000);
    assert_eq!(driver.outgoing(), frame);
    // A larger count than the frame's length marks the whole frame as sent.
    driver.sent(usize::MAX);
    assert!(driver.outgoing().is_empty());
}
