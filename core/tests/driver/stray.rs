//! Replies that come late, twice, or to something else are dropped.

use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::link::{FRAME_BYTES, FrameReader, PROTOCOL, Reply, Request, encode};
use glimpse_core::model::Phong;
use glimpse_core::scan::Reading;

use super::bench::{Bench, is_failed, is_finished};
use super::scanning::{material, whole};
use super::silence::with_phong;

/// A reply as a host writes it.
fn frame(sequence: u32, reply: &Reply) -> Vec<u8> {
    encode(sequence, reply, &mut [0; FRAME_BYTES])
        .unwrap()
        .to_vec()
}

/// The sequence number of a request's frame.
fn sequence_of(frame: &[u8]) -> u32 {
    let mut reader = FrameReader::new();
    let mut found = frame
        .iter()
        .filter_map(|byte| reader.push::<Request>(*byte));
    found.next().unwrap().unwrap().0
}

/// All that a host may say at the wrong time.
fn replies() -> Vec<Reply> {
    let other = Reading::monochrome(0.77);
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
            bytes: [1, 2, 3].into_iter().collect(),
        },
        Reply::Refused(glimpse_core::link::Refusal::NoScan),
    ];
    replies.extend((0..9).map(|index| Reply::Measured {
        index,
        reading: other,
    }));
    replies
}

/// Before each reply of the host come all others under wrong numbers, and those of another kind
/// under the right one; after it they come again.
#[test]
fn replies_to_other_requests_are_dropped() {
    for host in [Host::Measures, Host::Listens] {
        let config = Config {
            recipe_bytes: 1_000,
            ..Config::new(host)
        };
        with_phong(config, |driver| {
            let recipe = *driver.scan().unwrap().recipe();
            let expected = whole::<Phong>(recipe, material);
            let mut bench = Bench::willing();
            let mut reader = FrameReader::new();
            loop {
                let action = driver.poll(0);
                if is_finished(&action) {
                    break;
                }
                assert!(!is_failed(&action), "{action:?}");
                if let Action::Measure { index, .. } = action {
                    driver.record(index, material(index));
                }
                let bytes = driver.outgoing().to_vec();
                driver.sent(bytes.len());
                let stray = |driver: &mut Driver<'_, '_, Phong, 8>, sequence: u32| {
                    for reply in replies() {
                        for byte in frame(sequence, &reply) {
                            driver.receive(byte);
                        }
                    }
                };
                if bytes.is_empty() {
                    stray(driver, 1);
                    continue;
                }
                let sequence = sequence_of(&bytes);
                let (_, request) = bytes
                    .iter()
                    .find_map(|byte| reader.push::<Request>(*byte))
                    .unwrap()
                    .unwrap();
                for wrong in [0, sequence - 1, sequence + 1, u32::MAX] {
                    stray(driver, wrong);
                }
                for reply in replies().iter().filter(|reply| !reply.answers(&request)) {
                    for byte in frame(sequence, reply) {
                        driver.receive(byte);
                    }
                }
                assert!(matches!(driver.poll(0), Action::Wait { .. }));
                assert!(driver.outgoing().is_empty());
                let reply = bench.reply_to(&bytes);
                // Twice, as a repeated request is answered.
                for byte in reply.iter().chain(&reply) {
                    driver.receive(*byte);
                }
            }
            assert_eq!(bench.told(), (expected.bits().to_vec(), 1));
        });
    }
}

/// The same reply to a request that was repeated comes again after the next one was asked.
#[test]
fn a_late_reply_is_not_taken_for_the_next() {
    with_phong(Config::new(Host::Measures), |driver| {
        let mut bench = Bench::willing();
        let mut before: Vec<u8> = Vec::new();
        let mut asked = 0;
        loop {
            let action = driver.poll(100);
            if is_finished(&action) {
                break;
            }
            let bytes = driver.outgoing().to_vec();
            driver.sent(bytes.len());
            if bytes.is_empty() {
                continue;
            }
            asked += 1;
            for byte in &before {
                driver.receive(*byte);
            }
            assert!(matches!(driver.poll(0), Action::Wait { .. }));
            before = bench.reply_to(&bytes);
            for byte in &before {
                driver.receive(*byte);
            }
        }
        assert_eq!(bench.heard.len(), asked);
    });
}
