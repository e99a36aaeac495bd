//! A host that does not reply: requests are retransmitted on time, timeouts expire, and no reading is lost.

use std::cell::Cell;

use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::link::{Failure, Reply, Request};
use glimpse_core::scan::Reading;

use super::bench::{
    Bench, default_reply, is_failed, is_finished, is_measure, is_saved, new_driver, phong_driver,
};
use crate::scanning::{
    Any, MODELS, SAMPLES, full_scan, new_scan, recipe_for, record, synthetic_reading,
};

/// Checks that all frames are equal, one every 100 ms from the first one on.
fn check_retransmissions(frames: &[(u64, Vec<u8>)]) {
    for (repeat, (at, bytes)) in (0..).zip(frames) {
        assert_eq!(*at, frames[0].0 + 100 * repeat);
        assert_eq!(*bytes, frames[0].1);
    }
}

#[test]
fn hello_repeats_every_100_ms() {
    for host in [Host::Measures, Host::Listens] {
        let mut driver = phong_driver(Config::new(host));
        let mut bench = Bench::cooperative();
        bench.disconnected = true;
        bench.wait(&mut driver, 1_000_000);
        assert_eq!((bench.frames[0].0, bench.frames.len()), (0, 10_001));
        check_retransmissions(&bench.frames);
        assert!(bench.actions.is_empty());
        // The host appears.
        bench.disconnected = false;
        bench.run(&mut driver, is_finished);
    }
}

/// Delays of the firmware's loop do not accumulate.
#[test]
fn retransmissions_do_not_drift() {
    for period in [1_u32, 3, 7, 30, 99, 100] {
        let mut driver = phong_driver(Config::new(Host::Measures));
        let mut sent = Vec::new();
        for turn in 0..70_000 / u64::from(period) {
            let now = turn * u64::from(period);
            assert_eq!(driver.poll(now), Action::Wait);
            if !driver.outgoing().is_empty() {
                sent.push(now);
                driver.sent(1_000);
            }
            let delay = driver.poll_delay(now).unwrap();
            assert!((1..=100).contains(&delay));
        }
        for (due, at) in (0..).step_by(100).zip(&sent) {
            assert!((due..due + u64::from(period)).contains(at), "{due}, {at}");
        }
        assert!(sent.len() > 690, "{}", sent.len());
    }
}

/// After a long pause, the loop sends one retransmission, not all that it missed.
#[test]
fn missed_retransmissions_are_skipped() {
    let mut driver = phong_driver(Config::new(Host::Measures));
    let mut frames = 0;
    let mut now = 0;
    for elapsed in [0, 100_000, 0, 1, 98, 1, u64::from(u32::MAX), 0, 0] {
        now += elapsed;
        driver.poll(now);
        frames += u32::from(!driver.outgoing().is_empty());
        driver.sent(1_000);
    }
    assert_eq!(frames, 4);
}

/// `Hello` has no timeout: after months of retransmissions, the driver still requests a poll within 100 ms.
#[test]
fn hello_repeats_after_months() {
    let mut driver = phong_driver(Config::new(Host::Measures));
    for now in [0, 1 << 32, 1 << 33, (1 << 33) + 100, 1 << 63] {
        driver.poll(now);
        driver.sent(1_000);
        assert_eq!(driver.poll(now), Action::Wait);
        assert!(matches!(driver.poll_delay(now), Some(1..=100)));
    }
}

/// A frame that a slow line has not sent completely does not start again.
#[test]
fn unsent_frame_is_not_restarted() {
    let mut driver = phong_driver(Config::new(Host::Measures));
    driver.poll(0);
    let frame = driver.outgoing().to_vec();
    let (mut now, mut sent) = (0, Vec::new());
    while !driver.outgoing().is_empty() {
        sent.push(driver.outgoing()[0]);
        driver.sent(1);
        if sent.len() < frame.len() {
            now += 30;
            driver.poll(now);
            // No time is due, because a hello has no timeout.
            assert_eq!(driver.poll_delay(now), None);
        }
    }
    assert_eq!(sent, frame);
    driver.poll(now + 100);
    assert_eq!(driver.outgoing(), frame);
    // A larger count than the frame's length marks the whole frame as sent.
    driver.sent(usize::MAX);
    assert!(driver.outgoing().is_empty());
}

/// Checks that a host that stops replying at the first request of a kind causes a failure after `timeout_ms`.
fn check_timeout(is_last: fn(&Request) -> bool, timeout_ms: u64) {
    let mut config = Config::new(Host::Measures);
    config.recipe_bytes = 1_000;
    let offers = is_last(&Request::RecipePart { offset: 0 });
    let mut driver = phong_driver(config);
    let silent = Cell::new(true);
    let mut bench = Bench::new(|request| match request {
        request if is_last(request) && silent.get() => None,
        Request::Update if offers => Some(Reply::Recipe {
            bytes: 500,
            checksum: 7,
        }),
        _ => Some(default_reply(request)),
    });
    let failed = bench.run(&mut driver, is_failed);
    assert_eq!(failed, (timeout_ms, Action::Failed(Failure::NoReply)));
    let repeats = (timeout_ms / 100) as usize;
    check_retransmissions(&bench.frames[bench.frames.len() - repeats..]);
    let received = SAMPLES - driver.scan().unwrap().pending().count();

    // The readings are kept, and the device sends `Hello` again.
    bench.requests.clear();
    bench.take_actions();
    silent.set(false);
    bench.run(&mut driver, |action| {
        is_finished(action) || is_failed(action)
    });
    assert!(matches!(bench.requests[0], Request::Hello { .. }));
    if offers {
        return; // `recipe_update` tests the rest
    }
    let expected = full_scan::<Any>(*driver.scan().unwrap().recipe(), synthetic_reading);
    assert_eq!(bench.results(), (expected.bits().to_vec(), 1));
    let counts = (bench.count(is_saved), bench.count(is_measure));
    assert_eq!(counts, (received, SAMPLES - received));
    assert!(!bench.take_actions().contains(&Action::Forget));
}

#[test]
fn timeout_is_60_s_for_readings_and_2_s_otherwise() {
    check_timeout(|r| matches!(r, Request::Measure { index: 0, .. }), 60_000);
    check_timeout(|r| matches!(r, Request::Measure { index: 5, .. }), 60_000);
    check_timeout(|r| matches!(r, Request::Progress(_)), 2_000);
    check_timeout(
        |r| matches!(r, Request::Progress(progress) if progress.is_complete()),
        2_000,
    );
    check_timeout(|r| matches!(r, Request::Values { .. }), 2_000);
    check_timeout(|r| matches!(r, Request::Finished(_)), 2_000);
    check_timeout(|r| matches!(r, Request::Update), 2_000);
    check_timeout(|r| matches!(r, Request::RecipePart { .. }), 2_000);
}

/// Arms that need almost a minute for each move cause no timeout.
#[test]
fn timeout_restarts_with_each_request() {
    let mut driver = phong_driver(Config::new(Host::Measures));
    let mut bench = Bench::cooperative();
    bench.delay = Box::new(|request| if is_measure(request) { 59_900 } else { 1_900 });
    bench.run(&mut driver, |action| {
        is_finished(action) || is_failed(action)
    });
    // Each request was received once, despite its retransmissions.
    assert_eq!(bench.count(is_measure), 8);
    assert_eq!(bench.results().1, 1);
    assert!(bench.now > 8 * 59_000);
}

/// The device offers the host the readings that it took before a timeout or a reset. It does not take accepted readings
/// again, and the result is the same for each model.
#[test]
fn accepted_readings_are_not_repeated() {
    for model in MODELS {
        let recipe = recipe_for(model);
        let mut scan = new_scan::<Any>(recipe);
        record(&mut scan, [6, 1, 3], synthetic_reading);
        let mut driver = Driver::new(scan, Config::new(Host::Measures));
        let mut bench = Bench::cooperative();
        bench.run(&mut driver, is_finished);
        assert_eq!(
            bench.results().0,
            full_scan::<Any>(recipe, synthetic_reading).bits()
        );
        let (mut offered, mut measured) = (Vec::new(), Vec::new());
        for request in &bench.requests {
            match request {
                Request::Saved { index, reading } => {
                    assert_eq!(*reading, synthetic_reading(*index));
                    offered.push(*index);
                }
                Request::Measure { index, .. } => measured.push(*index),
                _ => {}
            }
        }
        assert_eq!((offered, measured), (vec![1, 3, 6], vec![0, 2, 4, 5, 7]));
        assert!(!bench.take_actions().contains(&Action::Forget));
    }
}

/// A fit clamps a reading that is too far below 0. The device does not offer the clamped reading, but measures it
/// again: the host has sent another value, and a host that compares values would reject all saved readings.
#[test]
fn only_clamped_readings_are_repeated() {
    for model in MODELS {
        let recipe = recipe_for(model);
        let noisy = |index| match index {
            2 => Reading::new([-0.9, 0.1, 0.1]),
            _ => synthetic_reading(index),
        };
        let mut driver = new_driver::<Any>(recipe, Config::new(Host::Measures));
        let mut bench = Bench::new(|request| match request {
            Request::Measure { index, .. } => {
                let (index, reading) = (*index, noisy(*index));
                Some(Reply::Measured { index, reading })
            }
            Request::Saved { index, reading } => {
                assert_eq!(*reading, noisy(*index));
                Some(Reply::Accepted)
            }
            _ => Some(default_reply(request)),
        });
        while !matches!(bench.requests.last(), Some(Request::Progress(_))) {
            bench.step(&mut driver);
        }
        bench.disconnected = true;
        bench.run(&mut driver, is_failed);
        bench.disconnected = false;
        bench.requests.clear();
        bench.run(&mut driver, is_finished);
        let measured = bench.count(is_measure);
        let clamped = driver.scan().unwrap().fitted().unwrap().residual().clamped;
        assert_eq!(measured, usize::from(clamped));
        assert!(measured >= 1);
        assert_eq!(bench.count(is_saved), 8 - measured);
        assert_eq!(bench.results().0, full_scan::<Any>(recipe, noisy).bits());
    }
}
