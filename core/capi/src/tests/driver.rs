//! A driver, alone and in front of a host.

use core::mem::MaybeUninit;
use core::ptr::{null, null_mut};
use std::vec::Vec;

use glimpse_core::link::{FRAME_BYTES, PROTOCOL, Received, Refusal, Reply, Request, Server};

use super::{Bytes, RECIPES, reading, values_by_core};
use crate::driver::{
    glimpse_config_default, glimpse_driver, glimpse_driver_begin, glimpse_driver_fail,
    glimpse_driver_outgoing, glimpse_driver_poll, glimpse_driver_receive, glimpse_driver_record,
    glimpse_driver_scan, glimpse_driver_sent,
};
use crate::fit::glimpse_fitted_values;
use crate::status::glimpse_status as Status;
use crate::types::{glimpse_action, glimpse_action_kind as Kind, glimpse_host, glimpse_kept};

fn begin(
    memory: &mut Bytes,
    recipe: &[u8],
    host: glimpse_host,
    kept: &[glimpse_kept],
) -> *mut glimpse_driver {
    let config = glimpse_config_default(host as i32);
    let mut driver = null_mut();
    let bytes = memory.bytes;
    let status = unsafe {
        glimpse_driver_begin(
            memory.pointer(),
            bytes,
            recipe.as_ptr(),
            recipe.len(),
            &raw const config,
            kept.as_ptr(),
            kept.len(),
            &raw mut driver,
        )
    };
    assert_eq!(status, Status::Ok);
    driver
}

fn poll(driver: *mut glimpse_driver) -> glimpse_action {
    let mut action = MaybeUninit::uninit();
    unsafe {
        let status = glimpse_driver_poll(driver, 1, action.as_mut_ptr());
        assert_eq!(status, Status::Ok);
        action.assume_init()
    }
}

fn values(driver: *const glimpse_driver) -> Vec<u32> {
    let (mut scan, mut count) = (null(), 0);
    let mut values = [0.0; 675];
    unsafe {
        assert_eq!(glimpse_driver_scan(driver, &raw mut scan), Status::Ok);
        let status = glimpse_fitted_values(scan, values.as_mut_ptr(), 675, &raw mut count);
        assert_eq!(status, Status::Ok);
    }
    let values = values.get(..count).unwrap();
    values.iter().map(|value| value.to_bits()).collect()
}

/// Nobody at the other end; some readings outlasted a reset, and one that is none.
#[test]
fn a_driver_alone_ends_in_the_same_bits_as_rust() {
    let mut memory = Bytes::for_driver();
    for recipe in RECIPES {
        let kept = [2, 5, 9999].map(|index| glimpse_kept {
            index,
            reading: reading(index),
        });
        let driver = begin(&mut memory, recipe, glimpse_host::Absent, &kept);
        let mut saved = 0;
        let mut kinds = 0_u32;
        loop {
            let action = poll(driver);
            kinds |= 1 << action.kind as i32;
            match action.kind {
                Kind::Measure => {
                    assert!(action.index != 2 && action.index != 5);
                    let reading = reading(action.index);
                    let status =
                        unsafe { glimpse_driver_record(driver, action.index, &raw const reading) };
                    assert_eq!(status, Status::Ok);
                }
                Kind::Save => {
                    assert_eq!(action.reading, reading(action.index));
                    saved += 1;
                }
                Kind::Finished => break assert!(action.residual.mean > 0.0),
                Kind::Failed => panic!("{:?}", action.failure),
                _ => {}
            }
        }
        assert_eq!(saved, 6);
        assert_eq!(values(driver), values_by_core(recipe));
        assert!(kinds & 1 << Kind::Continue as i32 != 0);
    }
}

/// A host that answers what it hears, with the recipe's bytes passing through.
struct Scanner {
    answerer: Server,
    values: Vec<f32>,
    refuses: Option<Refusal>,
    failures: usize,
}

impl Scanner {
    fn new() -> Self {
        Self {
            answerer: Server::new(),
            values: Vec::new(),
            refuses: None,
            failures: 0,
        }
    }

    /// Takes what the driver sends, hands back what it is answered.
    fn turn(&mut self, driver: *mut glimpse_driver) {
        let (mut bytes, mut count) = (null(), 0);
        let heard: Vec<u8> = unsafe {
            let status = glimpse_driver_outgoing(driver, &raw mut bytes, &raw mut count);
            assert_eq!(status, Status::Ok);
            let heard = core::slice::from_raw_parts(bytes, count).to_vec();
            assert_eq!(glimpse_driver_sent(driver, count), Status::Ok);
            heard
        };
        let mut frame = [0; FRAME_BYTES];
        for byte in heard {
            let answer = match self.answerer.receive(byte) {
                Some(Ok(Received::New(request))) => {
                    let reply = self.reply(request);
                    self.answerer.answer(reply, &mut frame).unwrap()
                }
                _ => continue,
            };
            let status = unsafe { glimpse_driver_receive(driver, answer.as_ptr(), answer.len()) };
            assert_eq!(status, Status::Ok);
        }
    }

    fn reply(&mut self, request: Request) -> Reply {
        match request {
            Request::Hello { .. } => Reply::Welcome { protocol: PROTOCOL },
            Request::Measure { .. } if self.refuses.is_some() => {
                Reply::Refused(self.refuses.unwrap())
            }
            Request::Measure { index, .. } => Reply::Measured {
                index,
                reading: reading(index).into(),
            },
            Request::Values { values, .. } => {
                self.values.extend_from_slice(&values);
                Reply::Accepted
            }
            Request::Failed(_) => {
                self.failures += 1;
                Reply::Accepted
            }
            _ => Reply::Accepted,
        }
    }
}

#[test]
fn a_host_measures_and_hears_the_same_bits() {
    let mut memory = Bytes::for_driver();
    for recipe in RECIPES {
        let driver = begin(&mut memory, recipe, glimpse_host::Measures, &[]);
        let mut scanner = Scanner::new();
        loop {
            let action = poll(driver);
            match action.kind {
                Kind::Finished => break,
                Kind::Failed => panic!("{:?}", action.failure),
                _ => scanner.turn(driver),
            }
        }
        let heard: Vec<u32> = scanner.values.iter().map(|value| value.to_bits()).collect();
        assert_eq!(heard, values_by_core(recipe));
        assert_eq!(values(driver), heard);
    }
}

#[test]
fn failures_are_told_to_both_sides() {
    let mut memory = Bytes::for_driver();
    // The host cannot reach a direction.
    let driver = begin(&mut memory, RECIPES[0], glimpse_host::Measures, &[]);
    let mut scanner = Scanner::new();
    scanner.refuses = Some(Refusal::Directions);
    let failure = until_failed(driver, &mut scanner);
    assert_eq!(failure, Status::RefusedDirections);
    // The device's arms fail.
    let driver = begin(&mut memory, RECIPES[0], glimpse_host::Listens, &[]);
    let mut scanner = Scanner::new();
    assert_eq!(unsafe { glimpse_driver_fail(driver) }, Status::Ok);
    assert_eq!(until_failed(driver, &mut scanner), Status::Machine);
    while scanner.failures == 0 {
        poll(driver);
        scanner.turn(driver);
    }
}

/// The host hears of a damaged recipe; on its own a device says so.
#[test]
fn a_driver_without_a_recipe_says_so() {
    let mut memory = Bytes::for_driver();
    let driver = begin(&mut memory, b"", glimpse_host::Absent, &[]);
    let mut scanner = Scanner::new();
    assert_eq!(until_failed(driver, &mut scanner), Status::RecipeMagic);
    let mut scan = core::ptr::dangling();
    let reading = reading(0);
    unsafe {
        assert_eq!(glimpse_driver_scan(driver, &raw mut scan), Status::NoScan);
        assert!(scan.is_null());
        let status = glimpse_driver_record(driver, 0, &raw const reading);
        assert_eq!(status, Status::NoScan);
    }
    let driver = begin(&mut memory, b"damaged", glimpse_host::Measures, &[]);
    for _ in 0..100 {
        poll(driver);
        scanner.turn(driver);
    }
    assert!(scanner.failures > 0);
}

fn until_failed(driver: *mut glimpse_driver, scanner: &mut Scanner) -> Status {
    for _ in 0..10_000 {
        let action = poll(driver);
        if action.kind == Kind::Failed {
            return action.failure;
        }
        scanner.turn(driver);
    }
    panic!("it never fails");
}
