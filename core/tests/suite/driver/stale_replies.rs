//! Replies that arrive late, twice, or to another request are dropped.

use glimpse_core::driver::{Action, Config, Host};
use glimpse_core::link::{PROTOCOL, RecipeBytes, Refusal, Reply, Request};
use glimpse_core::scan::Reading;

use super::bench::{AnyDriver, Bench, is_failed, is_finished, phong_driver};
use crate::link::{frame, read_frames};
use crate::scanning::{Any, full_scan, synthetic_reading};

fn receive(driver: &mut AnyDriver, bytes: &[u8]) {
    for byte in bytes {
        driver.receive(*byte);
    }
}

/// All replies that a host may give at the wrong time.
fn replies() -> Vec<Reply> {
    let mut replies = vec![
        Reply::Welcome { protocol: PROTOCOL },
        Reply::Welcome { protocol: 9 },
        Reply::Accepted,
        Reply::Recipe {
            bytes: 10,
            checksum: 3,
        },
        Reply::RecipePart {
            offset: 0,
            bytes: RecipeBytes::take_from([1, 2, 3]),
        },
        Reply::Refused(Refusal::NoScan),
    ];
    let reading = Reading::monochrome(0.77);
    replies.extend((0..9).map(|index| Reply::Measured { index, reading }));
    replies
}

/// Before each reply of the host, all other replies arrive with wrong sequence numbers, and replies of other kinds with
/// the right one. The reply itself arrives twice.
#[test]
fn drops_replies_to_other_requests() {
    for host in [Host::Measures, Host::Listens] {
        let mut config = Config::new(host);
        config.recipe_bytes = 1_000;
        let mut driver = phong_driver(config);
        let expected = full_scan::<Any>(*driver.scan().unwrap().recipe(), synthetic_reading);
        let mut bench = Bench::cooperative();
        loop {
            let action = driver.poll(0);
            if is_finished(&action) {
                break;
            }
            assert!(!is_failed(&action), "{action:?}");
            if let Action::Measure { index, .. } = action {
                driver.record(index, synthetic_reading(index));
            }
            let bytes = driver.outgoing().to_vec();
            driver.sent(bytes.len());
            let stray = |driver: &mut AnyDriver, sequence| {
                for reply in replies() {
                    receive(driver, &frame(sequence, &reply));
                }
            };
            if bytes.is_empty() {
                stray(&mut driver, 1);
                continue;
            }
            let (sequence, request) = read_frames::<Request>(&bytes)[0].clone().unwrap();
            for wrong in [0, sequence - 1, sequence + 1, u32::MAX] {
                stray(&mut driver, wrong);
            }
            for reply in replies().iter().filter(|reply| !reply.answers(&request)) {
                receive(&mut driver, &frame(sequence, reply));
            }
            assert_eq!(driver.poll(0), Action::Wait);
            assert!(driver.outgoing().is_empty());
            // Twice, like the reply to a retransmitted request.
            let reply = bench.reply_to(&bytes);
            receive(&mut driver, &reply.repeat(2));
        }
        assert_eq!(bench.results(), (expected.bits().to_vec(), 1));
    }
}

/// The reply to a retransmitted request arrives again after the next request.
#[test]
fn drops_late_replies() {
    let mut driver = phong_driver(Config::new(Host::Measures));
    let mut bench = Bench::cooperative();
    let mut before: Vec<u8> = Vec::new();
    let mut requested = 0;
    let mut now = 0;
    while !is_finished(&driver.poll(now)) {
        let bytes = driver.outgoing().to_vec();
        driver.sent(bytes.len());
        if bytes.is_empty() {
            continue;
        }
        requested += 1;
        receive(&mut driver, &before);
        assert_eq!(driver.poll(now), Action::Wait);
        before = bench.reply_to(&bytes);
        receive(&mut driver, &before);
        now += 100;
    }
    assert_eq!(bench.requests.len(), requested);
}
