//! A host that does not reply: requests are repeated on time, patience ends, nothing is lost.

use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::fit::Fitter;
use glimpse_core::link::{Failure, Reply, Request};
use glimpse_core::model::{ModelKind, Phong};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Memory, Reading, Scan};

use super::bench::{Bench, answer, is_failed, is_finished};
use super::scanning::{Outcome, SAMPLES, every_fitter, material, recipe_of, whole};

/// Runs `check` with a driver of Phong's.
pub(crate) fn with_phong(config: Config, check: impl FnOnce(&mut Driver<'_, '_, Phong, SAMPLES>)) {
    let bytes = recipe_of(ModelKind::Phong);
    let mut memory = Memory::<Phong, SAMPLES>::new();
    let scan = Scan::new(Recipe::parse(&bytes).unwrap(), &mut memory).unwrap();
    check(&mut Driver::new(Ok(scan), config));
}

/// All frames are the same, one every 100 ms from `start` on.
fn check_repeats(frames: &[(u64, Vec<u8>)], start: u64) {
    for (repeat, (at, bytes)) in (0..).zip(frames) {
        assert_eq!(*at, start + 100 * repeat);
        assert_eq!(*bytes, frames[0].1);
    }
}

#[test]
fn a_hello_is_repeated_every_100_ms_for_ever() {
    for host in [Host::Measures, Host::Listens] {
        with_phong(Config::new(host), |driver| {
            let mut bench = Bench::willing();
            bench.deaf = true;
            bench.wait(driver, 1_000_000);
            assert_eq!(bench.frames.len(), 10_001);
            check_repeats(&bench.frames, 0);
            assert!(bench.actions.is_empty());
            // And then somebody is there.
            bench.deaf = false;
            bench.run(driver, is_finished);
        });
    }
}

/// Whatever the firmware's loop does meanwhile: lateness does not add up.
#[test]
fn repeats_keep_their_time_in_loops_of_any_period() {
    for period in [1_u32, 3, 7, 30, 99, 100] {
        with_phong(Config::new(Host::Measures), |driver| {
            let mut sent = Vec::new();
            for turn in 0..70_000 / u64::from(period) {
                let waits = driver.poll(if turn == 0 { 0 } else { period });
                let Action::Wait { milliseconds } = waits else {
                    panic!("{waits:?}")
                };
                assert!((1..=100).contains(&milliseconds));
                if !driver.outgoing().is_empty() {
                    sent.push(turn * u64::from(period));
                    driver.sent(1_000);
                }
            }
            for (due, at) in (0..).step_by(100).zip(&sent) {
                assert!((due..due + u64::from(period)).contains(at), "{due}, {at}");
            }
            assert!(sent.len() > 690, "{}", sent.len());
        });
    }
}

/// A loop that stood still for long sends once and not as often as it missed.
#[test]
fn missed_repeats_are_not_made_up_for() {
    with_phong(Config::new(Host::Measures), |driver| {
        let mut frames = 0;
        for elapsed in [0, 100_000, 0, 1, 98, 1, u32::MAX, 0, 0] {
            driver.poll(elapsed);
            frames += u32::from(!driver.outgoing().is_empty());
            driver.sent(1_000);
        }
        assert_eq!(frames, 4);
    });
}

/// A host is greeted for as long as it takes: for months there is something to sleep for.
#[test]
fn who_greets_for_months_may_still_sleep() {
    with_phong(Config::new(Host::Measures), |driver| {
        for elapsed in [0, u32::MAX, u32::MAX, 100] {
            driver.poll(elapsed);
            driver.sent(1_000);
            let action = driver.poll(0);
            assert!(
                matches!(action, Action::Wait { milliseconds: 1.. }),
                "{action:?}"
            );
        }
    });
}

/// A frame that a slow line still has to send is not begun again.
#[test]
fn a_frame_that_is_not_sent_yet_is_not_repeated() {
    with_phong(Config::new(Host::Measures), |driver| {
        driver.poll(0);
        let frame = driver.outgoing().to_vec();
        let mut sent = Vec::new();
        while !driver.outgoing().is_empty() {
            sent.push(driver.outgoing()[0]);
            driver.sent(1);
            if sent.len() < frame.len() {
                driver.poll(30);
            }
        }
        assert_eq!(sent, frame);
        driver.poll(100);
        assert_eq!(driver.outgoing(), frame);
        // More than there is was not sent.
        driver.sent(usize::MAX);
        assert!(driver.outgoing().is_empty());
    });
}

/// Silence from the first request of this kind on, a device that can store recipes; when it is
/// noticed, and what the driver does then.
fn silent_from(is_last: fn(&Request) -> bool, patience: u64) {
    let config = Config {
        recipe_bytes: 1_000,
        ..Config::new(Host::Measures)
    };
    with_phong(config, |driver| {
        let silent = std::cell::Cell::new(true);
        let mut bench = Bench::new(|request| {
            (!(is_last(request) && silent.get())).then(|| match request {
                Request::Update if is_last(&Request::RecipePart { offset: 0 }) => Reply::Recipe {
                    bytes: 500,
                    checksum: 7,
                },
                _ => answer(request),
            })
        });
        bench.run(driver, is_failed);
        let (at, failed) = bench.actions.last().unwrap();
        assert_eq!(*failed, Action::Failed(Failure::NoReply));
        assert_eq!(*at, patience);
        let repeats = (patience / 100) as usize;
        let from = bench.frames.len() - repeats;
        check_repeats(&bench.frames[from..], 0);
        let read = SAMPLES - driver.scan().unwrap().pending().count();

        // Readings are kept, and the host is greeted.
        bench.heard.clear();
        bench.take_actions();
        silent.set(false);
        let bits = match whole::<Phong>(*driver.scan().unwrap().recipe(), material) {
            Outcome::Fitted(bits, _) => bits,
            other => panic!("{other:?}"),
        };
        bench.run(driver, |action| is_finished(action) || is_failed(action));
        assert!(matches!(bench.heard[0], Request::Hello { .. }));
        if is_last(&Request::RecipePart { offset: 0 }) {
            return; // `update` has what follows
        }
        assert_eq!(bench.told(), (bits, 1));
        let count = |what: fn(&Request) -> bool| bench.heard.iter().filter(|r| what(r)).count();
        assert_eq!(count(|r| matches!(r, Request::Kept { .. })), read);
        assert_eq!(
            count(|r| matches!(r, Request::Measure { .. })),
            SAMPLES - read
        );
        assert!(!bench.take_actions().contains(&Action::Forget));
    });
}

#[test]
fn patience_is_a_minute_for_readings_and_2_s_for_all_else() {
    silent_from(
        |request| matches!(request, Request::Measure { index: 0, .. }),
        60_000,
    );
    silent_from(
        |request| matches!(request, Request::Measure { index: 5, .. }),
        60_000,
    );
    silent_from(|request| matches!(request, Request::Progress(_)), 2_000);
    silent_from(
        |request| matches!(request, Request::Progress(progress) if progress.is_complete()),
        2_000,
    );
    silent_from(|request| matches!(request, Request::Values { .. }), 2_000);
    silent_from(|request| matches!(request, Request::Finished(_)), 2_000);
    silent_from(|request| matches!(request, Request::Update), 2_000);
    silent_from(
        |request| matches!(request, Request::RecipePart { .. }),
        2_000,
    );
}

/// Arms that need most of a minute for each move cost no reading.
#[test]
fn patience_begins_anew_with_each_request() {
    with_phong(Config::new(Host::Measures), |driver| {
        let mut bench = Bench::willing();
        bench.delay = Box::new(|request| match request {
            Request::Measure { .. } => 59_900,
            _ => 1_900,
        });
        bench.run(driver, |action| is_finished(action) || is_failed(action));
        // Each was heard once, however often it was asked.
        let measured = |request: &&Request| matches!(request, Request::Measure { .. });
        assert_eq!(bench.heard.iter().filter(measured).count(), 8);
        assert_eq!(bench.told().1, 1);
        assert!(bench.now > 8 * 59_000);
    });
}

/// Readings that outlasted a silence or a reset are offered; those that are accepted are not taken
/// again, in any of the models, and the result is the same.
#[test]
fn accepted_readings_are_not_taken_again() {
    fn check<K: Fitter>(recipe: Recipe<'_>) {
        let expected = whole::<K>(recipe, material);
        let mut memory = Memory::<K, SAMPLES>::new();
        let mut scan = Scan::new(recipe, &mut memory).unwrap();
        let kept = [6, 1, 3];
        for index in kept {
            scan.record(index, material(index)).unwrap();
        }
        let mut driver = Driver::new(Ok(scan), Config::new(Host::Measures));
        let mut bench = Bench::willing();
        bench.run(&mut driver, is_finished);
        assert_eq!(bench.told().0, expected.bits());
        let offered: Vec<u16> = bench
            .heard
            .iter()
            .filter_map(|request| match request {
                Request::Kept { index, reading } => {
                    assert_eq!(*reading, material(*index));
                    Some(*index)
                }
                _ => None,
            })
            .collect();
        assert_eq!(offered, [1, 3, 6]);
        let measured: Vec<u16> = bench
            .heard
            .iter()
            .filter_map(|request| match request {
                Request::Measure { index, .. } => Some(*index),
                _ => None,
            })
            .collect();
        assert_eq!(measured, [0, 2, 4, 5, 7]);
        assert!(!bench.take_actions().contains(&Action::Forget));
    }
    every_fitter!(check);
}

/// A fit brings up what is too far below 0. That is not what the host gave, and so it is not offered:
/// a host that compares would have all of them taken anew.
#[test]
fn a_reading_that_a_fit_has_clamped_is_taken_again_and_no_other() {
    fn check<K: Fitter>(recipe: Recipe<'_>) {
        let noisy = |index| match index {
            2 => Reading::new([-0.9, 0.1, 0.1]),
            _ => material(index),
        };
        let mut memory = Memory::<K, SAMPLES>::new();
        let scan = Scan::new(recipe, &mut memory).unwrap();
        let mut driver = Driver::new(Ok(scan), Config::new(Host::Measures));
        let mut bench = Bench::new(|request| match request {
            Request::Measure { index, .. } => {
                let (index, reading) = (*index, noisy(*index));
                Some(Reply::Measured { index, reading })
            }
            Request::Kept { index, reading } => {
                assert_eq!(*reading, noisy(*index));
                Some(Reply::Accepted)
            }
            _ => Some(answer(request)),
        });
        while !matches!(bench.heard.last(), Some(Request::Progress(_))) {
            bench.turn(&mut driver);
        }
        bench.deaf = true;
        bench.run(&mut driver, is_failed);
        bench.deaf = false;
        bench.heard.clear();
        bench.run(&mut driver, is_finished);
        let of = |what: fn(&Request) -> bool| bench.heard.iter().filter(|r| what(r)).count();
        let measured = of(|request| matches!(request, Request::Measure { .. }));
        let clamped = driver.scan().unwrap().fitted().unwrap().residual().clamped;
        assert!(
            measured >= 1 && measured == usize::from(clamped),
            "{measured}"
        );
        assert_eq!(
            of(|request| matches!(request, Request::Kept { .. })),
            8 - measured
        );
        assert_eq!(bench.told().0, whole::<K>(recipe, noisy).bits());
    }
    every_fitter!(check);
}
