//! Differential test: a driver in C and one in Rust, with the same host, noisy line, sensor and faults, do the same.

use core::mem::zeroed;
use core::ptr::null;
use std::collections::HashSet;
use std::vec;
use std::vec::Vec;
use std::{format, string::String};

use glimpse_core::driver::{Config, Driver, Host};
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::gonio::{Limits, Machine};
use glimpse_core::link::{
    BYTES_PER_FRAME, FRAME_BYTES, PROTOCOL, RecipeBytes, Reply, Request, Server,
};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Saved, Scan};

use super::scans::assert_fitted;
use super::{AlignedMemory, MASKED, RECIPES, Random, UNLIKE, WORDS, begin_driver, reading};
use crate::driver::*;
use crate::handle::{ScanModel, glimpse_driver};
use crate::status::glimpse_status as Status;
use crate::types::{glimpse_action, glimpse_action_kind as Kind, glimpse_host, glimpse_saved};

/// A driver in C and the same one in Rust.
struct Pair<'a> {
    c: *mut glimpse_driver,
    core: Driver<'a, ScanModel>,
}

impl Pair<'_> {
    fn poll(&mut self, now_ms: u64) -> glimpse_action {
        let mut delay = 7;
        let mut action: glimpse_action = unsafe { zeroed() };
        let found = unsafe {
            [
                glimpse_driver_poll(self.c, now_ms, &raw mut action),
                glimpse_driver_poll_delay(self.c, now_ms, &raw mut delay),
            ]
        };
        assert_eq!(found, [Status::Ok; 2]);
        let expected: glimpse_action = self.core.poll(now_ms).into();
        assert_eq!(format!("{action:?}"), format!("{expected:?}"));
        assert_eq!(delay, self.core.poll_delay(now_ms).unwrap_or(u32::MAX));
        action
    }

    /// Sends up to `count` bytes, and returns them.
    fn send(&mut self, count: usize) -> Vec<u8> {
        let (mut bytes, mut length) = (null(), 0);
        let mut expected = self.core.outgoing().to_vec();
        unsafe {
            let status = glimpse_driver_outgoing(self.c, &raw mut bytes, &raw mut length);
            assert_eq!(status, Status::Ok);
            assert_eq!(core::slice::from_raw_parts(bytes, length), expected);
            assert_eq!(glimpse_driver_sent(self.c, count), Status::Ok);
        }
        self.core.sent(count);
        expected.truncate(count);
        expected
    }

    fn receive(&mut self, bytes: &[u8]) {
        let status = unsafe { glimpse_driver_receive(self.c, bytes.as_ptr(), bytes.len()) };
        assert_eq!(status, Status::Ok);
        bytes.iter().for_each(|byte| self.core.receive(*byte));
    }

    /// A random call of the firmware for a sample, mostly a reading of it. Returns its status.
    fn call(&mut self, index: u16, random: &mut Random) -> Status {
        let (c, core) = (self.c, &mut self.core);
        let status =
            |result: Result<(), Error>| result.map_or_else(|error| error.into(), |()| Status::Ok);
        let (expected, found) = match random.below(24) {
            0 => (status(core.skip(index)), unsafe {
                glimpse_driver_skip(c, index)
            }),
            1 => (status(core.finish_early()), unsafe {
                glimpse_driver_finish_early(c)
            }),
            2 => {
                core.fail(Error::new(ErrorCode::Machine));
                let failure = Status::Machine as i32;
                (Status::Ok, unsafe { glimpse_driver_fail(c, failure) })
            }
            3 => {
                core.restart();
                (Status::Ok, unsafe { glimpse_driver_restart(c) })
            }
            4 => {
                core.resume();
                (Status::Ok, unsafe { glimpse_driver_resume(c) })
            }
            _ => {
                let reading = random.reading(index);
                let c_reading = reading.into();
                (status(core.record(index, reading)), unsafe {
                    glimpse_driver_record(c, index, &raw const c_reading)
                })
            }
        };
        assert_eq!(found, expected);
        found
    }

    /// Rejects the stored recipe, or reports that it could not be stored.
    fn reject(&mut self, stored: &[u8], random: &mut Random) {
        let (failure, found) = match Recipe::parse(stored) {
            Err(error) if random.below(2) == 0 => (error, unsafe {
                glimpse_driver_reject(self.c, stored.as_ptr(), stored.len())
            }),
            _ => (Error::new(ErrorCode::Storage), unsafe {
                glimpse_driver_fail(self.c, Status::Storage as i32)
            }),
        };
        self.core.fail(failure);
        assert_eq!(found, Status::Ok);
    }

    fn assert_scan(&self) {
        let mut scan = null();
        let status = unsafe { glimpse_driver_scan(self.c, &raw mut scan) };
        match self.core.scan() {
            Ok(core) => assert_fitted(scan, core.fitted()),
            Err(_) => assert_eq!((status, scan), (Status::NotScanning, null())),
        }
    }
}

/// The recipe that the host offers. It is damaged.
const OFFERED: [u8; 130] = [7; 130];

/// The reply of a host that measures, skips, refuses or finishes at random.
fn reply(request: &Request, random: &mut Random) -> Reply {
    match (request, random.below(60)) {
        (Request::Hello { .. }, _) => Reply::Welcome { protocol: PROTOCOL },
        (Request::Measure { .. }, 0) => Reply::FinishEarly,
        (Request::Measure { index, .. }, 1) => Reply::Skip { index: *index },
        (Request::Measure { .. }, 2) => Reply::Refused(ErrorCode::RefusedDirections),
        (Request::Measure { index, .. }, _) => Reply::Measured {
            index: *index,
            reading: random.reading(*index),
        },
        (Request::Update, _) => Reply::Recipe {
            bytes: OFFERED.len() as u32,
            checksum: 9,
        },
        (Request::RecipePart { offset }, _) => {
            let rest = OFFERED.iter().copied().skip(*offset as usize);
            Reply::RecipePart {
                offset: *offset,
                bytes: RecipeBytes::take_from(rest.take(BYTES_PER_FRAME)),
            }
        }
        (_, 0) => Reply::Refused(ErrorCode::RefusedSaved),
        _ => Reply::Accepted,
    }
}

/// Returns the bytes of the replies to received bytes.
fn exchange(server: &mut Server, received: &[u8], random: &mut Random) -> Vec<u8> {
    let (mut sent, mut frame) = (Vec::new(), [0; FRAME_BYTES]);
    for byte in received {
        let respond = |request| Some(reply(&request, random));
        sent.extend(
            server
                .answer(*byte, &mut frame, respond)
                .unwrap_or_default(),
        );
    }
    sent
}

/// Damages one byte of a hundred.
fn damage(bytes: &mut [u8], random: &mut Random) {
    for byte in bytes {
        *byte ^= u8::from(random.below(100) == 0);
    }
}

/// One run with a recipe. Adds the kinds of actions and the statuses to `found`.
fn run(recipe: &[u8], role: glimpse_host, seed: u64, found: &mut HashSet<String>) {
    let (mut random, mut memory) = (Random(seed), AlignedMemory::for_driver());
    let mut words = vec![0.0; WORDS];
    let mut c = glimpse_config_default(role as i32);
    let mut config = Config::new(match role {
        glimpse_host::Measures => Host::Measures,
        glimpse_host::Listens => Host::Listens,
        glimpse_host::Absent => Host::Absent,
    });
    (c.attempts, config.attempts) = (2, 2);
    (c.sequence_seed, config.sequence_seed) = (seed as u32, seed as u32);
    (c.steps_per_poll, config.steps_per_poll) = (30, 30);
    (c.retransmit_interval_ms, config.retransmit_interval_ms) = (50, 50);
    (c.reply_timeout_ms, config.reply_timeout_ms) = (500, 500);
    (c.measure_timeout_ms, config.measure_timeout_ms) = (900, 900);
    if seed.is_multiple_of(3) {
        let mut machine = Machine::new(Limits::NONE);
        machine.limits.max_theta_i = [1.2, 0.7, 1.5][seed as usize / 3 % 3];
        (c.has_machine, c.machine) = (1, machine.into());
        config.machine = Some(machine);
    }
    if seed.is_multiple_of(2) {
        (c.recipe_bytes, config.recipe_bytes) = (2000, 2000);
        (c.target_loss, config.target_loss) = (0.05, Some(0.05));
    }
    let parsed = Recipe::parse(recipe);
    let mut scan = parsed.map(|recipe| Scan::new(recipe, &mut words).unwrap());

    // Readings that survived a reset.
    let mut slot = [0xFF; Saved::slot_bytes(16)];
    if let Ok(scan) = &mut scan
        && seed.is_multiple_of(4)
    {
        scan.record(2, reading(2)).unwrap();
        scan.record(5, reading(5)).unwrap();
        let written = Saved::default().write(scan, &mut [0; 300], |_, bytes| {
            slot[..bytes.len()].copy_from_slice(bytes);
            Ok::<_, Error>(())
        });
        assert_eq!(written, Ok(()));
    }
    let saved = glimpse_saved {
        slots: [slot.as_ptr(); 2],
        slot_bytes: slot.len(),
    };
    let (status, c) = begin_driver(&mut memory, recipe, &c, Some(&saved));
    assert_eq!(status, Status::Ok);
    let core = match scan {
        Ok(scan) => Driver::new(scan, config),
        Err(failure) => Driver::without_scan(failure, config),
    };

    let (mut pair, mut server, mut stored) = (Pair { c, core }, Server::new(), Vec::new());
    let mut now_ms = u64::from(u32::MAX) - 3;
    for _ in 0..2000 {
        let action = pair.poll(now_ms);
        found.insert(format!("{:?}", action.kind));
        now_ms += [0, 1, 7, 90][random.below(4) as usize];
        match action.kind {
            Kind::Measure => {
                found.insert(format!("{:?}", pair.call(action.index, &mut random)));
            }
            Kind::Store => {
                stored.truncate(action.offset as usize);
                stored.extend_from_slice(&action.bytes[..usize::from(action.byte_count)]);
            }
            Kind::Install => {
                assert_eq!(
                    (stored.as_slice(), action.checksum),
                    (OFFERED.as_slice(), 9)
                );
                assert_eq!(action.offset as usize, OFFERED.len());
                pair.reject(&stored, &mut random);
            }
            Kind::Failed => {
                found.insert(format!("{:?}", action.failure));
                pair.assert_scan();
            }
            Kind::Finished => pair.assert_scan(),
            Kind::Wait if random.below(20) == 0 => {
                let index = random.below(17) as u16;
                found.insert(format!("{:?}", pair.call(index, &mut random)));
            }
            _ => {}
        }
        let mut bytes = pair.send(random.below(50) as usize);
        damage(&mut bytes, &mut random);
        let mut replies = exchange(&mut server, &bytes, &mut random);
        damage(&mut replies, &mut random);
        pair.receive(&replies);
    }
}

#[test]
fn drivers_match_core() {
    let mut found = HashSet::new();
    let recipes = RECIPES.into_iter().chain([MASKED, UNLIKE, b"damaged"]);
    for (recipe, number) in recipes.zip(0..) {
        for seed in 4 * number..4 * number + 4 {
            run(recipe, glimpse_host::Measures, seed, &mut found);
            run(recipe, glimpse_host::Listens, seed, &mut found);
            run(recipe, glimpse_host::Absent, seed, &mut found);
        }
    }
    for expected in [
        "Wait",
        "Continue",
        "Measure",
        "Save",
        "Forget",
        "Store",
        "Install",
        "Finished",
        "Failed",
        "Ok",
        "NotScanning",
        "ReadingNonFinite",
        "ReadingIndex",
        "ReadingRequired",
        "RecipeMagic",
        "Machine",
        "Storage",
        "NoReply",
        "RefusedDirections",
        "OutOfReach",
    ] {
        assert!(found.contains(expected), "{expected}");
    }
}
