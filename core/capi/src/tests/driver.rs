//! Tests of drivers with and without a host.

use core::cell::Cell;
use core::mem::MaybeUninit;
use core::ptr::{null, null_mut};
use std::vec::Vec;
use std::{thread_local, vec};

use glimpse_core::fit::Uncertainty;
use glimpse_core::link::{FRAME_BYTES, PROTOCOL, Received, Refusal, Reply, Request, Server};
use glimpse_core::recipe::{PackedPartialLoss, Recipe, RecipeParts};
use glimpse_core::scan::Scan;

use super::{AlignedMemory, MASKED, RECIPES, WORDS, reading, values_with_core};
use crate::configuration::Fitter;
use crate::driver::{
    glimpse_config_default, glimpse_driver, glimpse_driver_begin, glimpse_driver_fail,
    glimpse_driver_outgoing, glimpse_driver_poll, glimpse_driver_poll_delay,
    glimpse_driver_receive, glimpse_driver_record, glimpse_driver_restart, glimpse_driver_scan,
    glimpse_driver_sent,
};
use crate::fit::glimpse_fitted_values;
use crate::status::glimpse_status as Status;
use crate::types::{
    glimpse_action, glimpse_action_kind as Kind, glimpse_config, glimpse_host, glimpse_saved,
};

pub(super) fn begin(
    memory: &mut AlignedMemory,
    recipe: &[u8],
    host: glimpse_host,
    saved: &[glimpse_saved],
) -> *mut glimpse_driver {
    begin_with(memory, recipe, &glimpse_config_default(host as i32), saved)
}

fn begin_with(
    memory: &mut AlignedMemory,
    recipe: &[u8],
    config: &glimpse_config,
    saved: &[glimpse_saved],
) -> *mut glimpse_driver {
    let mut driver = null_mut();
    let bytes = memory.bytes;
    let status = unsafe {
        glimpse_driver_begin(
            memory.pointer(),
            bytes,
            recipe.as_ptr(),
            recipe.len(),
            config,
            saved.as_ptr(),
            saved.len(),
            &raw mut driver,
        )
    };
    assert_eq!(status, Status::Ok);
    driver
}

/// Polls one millisecond after the previous poll.
pub(super) fn poll(driver: *mut glimpse_driver) -> glimpse_action {
    thread_local!(static NOW_MS: Cell<u64> = const { Cell::new(0) });
    NOW_MS.set(NOW_MS.get() + 1);
    poll_at(driver, NOW_MS.get())
}

fn poll_at(driver: *mut glimpse_driver, now_ms: u64) -> glimpse_action {
    let mut action = MaybeUninit::uninit();
    unsafe {
        let status = glimpse_driver_poll(driver, now_ms, action.as_mut_ptr());
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

/// A driver begins with saved readings, one of which has an invalid index.
#[test]
fn driver_without_host_matches_core() {
    let mut memory = AlignedMemory::for_driver();
    for recipe in RECIPES {
        let saved = [2, 5, 9999].map(|index| glimpse_saved {
            index,
            reading: reading(index),
        });
        let driver = begin(&mut memory, recipe, glimpse_host::Absent, &saved);
        let mut save_count = 0;
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
                    save_count += 1;
                }
                Kind::Finished => break assert!(action.residual.mean > 0.0),
                Kind::Failed => panic!("{:?}", action.failure),
                _ => {}
            }
        }
        assert_eq!(save_count, 6);
        assert_eq!(values(driver), values_with_core(recipe));
        assert!(kinds & 1 << Kind::Continue as i32 != 0);
    }
}

/// A host that replies to every request.
struct TestHost {
    server: Server,
    values: Vec<f32>,
    /// Reply to `Request::Measure` instead of a reading.
    refusal: Option<Refusal>,
    failures: usize,
}

impl TestHost {
    fn new() -> Self {
        Self {
            server: Server::new(),
            values: Vec::new(),
            refusal: None,
            failures: 0,
        }
    }

    /// Passes the driver's bytes to the host, and the replies to the driver.
    fn exchange(&mut self, driver: *mut glimpse_driver) {
        let (mut bytes, mut count) = (null(), 0);
        let received: Vec<u8> = unsafe {
            let status = glimpse_driver_outgoing(driver, &raw mut bytes, &raw mut count);
            assert_eq!(status, Status::Ok);
            let received = core::slice::from_raw_parts(bytes, count).to_vec();
            assert_eq!(glimpse_driver_sent(driver, count), Status::Ok);
            received
        };
        let mut frame = [0; FRAME_BYTES];
        for byte in received {
            let encoded = match self.server.receive(byte) {
                Some(Ok(Received::New(request))) => {
                    let reply = self.reply(request);
                    self.server.reply(reply, &mut frame).unwrap()
                }
                _ => continue,
            };
            let status = unsafe { glimpse_driver_receive(driver, encoded.as_ptr(), encoded.len()) };
            assert_eq!(status, Status::Ok);
        }
    }

    fn reply(&mut self, request: Request) -> Reply {
        match request {
            Request::Hello { .. } => Reply::Welcome { protocol: PROTOCOL },
            Request::Measure { .. } if self.refusal.is_some() => {
                Reply::Refused(self.refusal.unwrap())
            }
            Request::Measure { index, .. } => Reply::Measured {
                index,
                reading: reading(index).into(),
            },
            Request::Values { values, .. } => {
                self.values.extend_from_slice(values.as_slice());
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
fn driver_with_host_matches_core() {
    let mut memory = AlignedMemory::for_driver();
    for recipe in RECIPES {
        let driver = begin(&mut memory, recipe, glimpse_host::Measures, &[]);
        let mut host = TestHost::new();
        loop {
            let action = poll(driver);
            match action.kind {
                Kind::Finished => break,
                Kind::Failed => panic!("{:?}", action.failure),
                _ => host.exchange(driver),
            }
        }
        let received: Vec<u32> = host.values.iter().map(|value| value.to_bits()).collect();
        assert_eq!(received, values_with_core(recipe));
        assert_eq!(values(driver), received);
    }
}

#[test]
fn failures_are_reported_to_host_and_firmware() {
    let mut memory = AlignedMemory::for_driver();
    // The host cannot reach a direction.
    let driver = begin(&mut memory, RECIPES[0], glimpse_host::Measures, &[]);
    let mut host = TestHost::new();
    host.refusal = Some(Refusal::Directions);
    let failure = poll_until_failed(driver, &mut host);
    assert_eq!(failure, Status::RefusedDirections);
    // The device's arms fail.
    let driver = begin(&mut memory, RECIPES[0], glimpse_host::Listens, &[]);
    let mut host = TestHost::new();
    assert_eq!(unsafe { glimpse_driver_fail(driver) }, Status::Ok);
    assert_eq!(poll_until_failed(driver, &mut host), Status::Machine);
    while host.failures == 0 {
        poll(driver);
        host.exchange(driver);
    }
}

/// A driver reports a damaged recipe to the host. Without a host, it reports the recipe to the firmware.
#[test]
fn driver_reports_unusable_recipe() {
    let mut memory = AlignedMemory::for_driver();
    let driver = begin(&mut memory, b"", glimpse_host::Absent, &[]);
    let mut host = TestHost::new();
    assert_eq!(poll_until_failed(driver, &mut host), Status::RecipeMagic);
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
        host.exchange(driver);
    }
    assert!(host.failures > 0);
}

fn poll_until_failed(driver: *mut glimpse_driver, host: &mut TestHost) -> Status {
    for _ in 0..10_000 {
        let action = poll(driver);
        if action.kind == Kind::Failed {
            return action.failure;
        }
        host.exchange(driver);
    }
    panic!("the driver does not fail");
}

fn delay(driver: *const glimpse_driver, now_ms: u64) -> u32 {
    let mut delay_ms = 7;
    let status = unsafe { glimpse_driver_poll_delay(driver, now_ms, &raw mut delay_ms) };
    assert_eq!(status, Status::Ok);
    delay_ms
}

/// Delays match the configuration. The time may have any origin within 64 bits.
#[test]
fn poll_delay_matches_timeouts() {
    let start_ms = u64::from(u32::MAX) - 3;
    let mut memory = AlignedMemory::for_driver();
    let mut config = glimpse_config_default(glimpse_host::Listens as i32);
    config.retransmit_interval_ms = 250;
    let driver = begin_with(&mut memory, RECIPES[0], &config, &[]);
    assert_eq!(delay(driver, start_ms), 0);
    assert_eq!(poll_at(driver, start_ms).kind, Kind::Wait);
    poll_at(driver, start_ms);
    // The greeting has no timeout. Its retransmission interval begins when it has been sent.
    assert_eq!(delay(driver, start_ms), u32::MAX);
    assert_eq!(unsafe { glimpse_driver_sent(driver, 999) }, Status::Ok);
    assert_eq!(delay(driver, start_ms), 250);
    assert_eq!(delay(driver, start_ms + 200), 50);
    assert_eq!(delay(driver, start_ms + 300), 0);
    // Without a host the driver does not continue after a failure.
    let driver = begin(&mut memory, RECIPES[0], glimpse_host::Absent, &[]);
    assert_eq!(unsafe { glimpse_driver_fail(driver) }, Status::Ok);
    while poll_at(driver, start_ms).kind != Kind::Wait {}
    assert_eq!(delay(driver, start_ms), u32::MAX);
    assert_eq!(unsafe { glimpse_driver_restart(driver) }, Status::Ok);
    assert_eq!(delay(driver, start_ms), 0);
}

#[test]
fn samples_out_of_reach_fail_before_first_move() {
    let mut memory = AlignedMemory::for_driver();
    let mut config = glimpse_config_default(glimpse_host::Absent as i32);
    config.has_limits = 1;
    config.limits.max_theta_i = 0.01;
    let driver = begin_with(&mut memory, RECIPES[0], &config, &[]);
    let mut host = TestHost::new();
    assert_eq!(poll_until_failed(driver, &mut host), Status::OutOfReach);
}

/// A driver with too little memory for its recipe has no scan.
#[test]
fn driver_reports_insufficient_memory() {
    let mut memory = AlignedMemory::for_driver();
    memory.bytes = crate::configuration::driver_bytes(0).unwrap();
    let driver = begin(&mut memory, RECIPES[2], glimpse_host::Absent, &[]);
    let mut host = TestHost::new();
    assert_eq!(poll_until_failed(driver, &mut host), Status::Memory);
}

/// The bound of the loss for each number of readings is this multiple of the predicted loss.
const BOUNDS: [f32; 16] = [
    9.0, 8.0, 7.0, 6.0, 5.0, 4.0, 3.5, 3.0, 2.9, 2.8, 2.7, 2.6, 2.5, 2.4, 2.3, 2.2,
];

/// The recipe [`MASKED`], with bounds of the loss for each number of readings.
fn recipe_with_bounds() -> Vec<u8> {
    let recipe = Recipe::parse(MASKED).unwrap();
    let pattern: Vec<u8> = recipe
        .pattern()
        .flat_map(|angles| [angles.theta_h, angles.theta_d, angles.phi_d])
        .flat_map(f32::to_le_bytes)
        .collect();
    let components = recipe.completed().unwrap().coefficient_net().components;
    let mut prediction = vec![0.0; components + 1];
    prediction[0] = -4_f32;
    let prediction: Vec<u8> = prediction.into_iter().flat_map(f32::to_le_bytes).collect();
    let bound = BOUNDS.map(f32::to_le_bytes);
    let parts = RecipeParts {
        prediction: Some(&prediction),
        uncertainty: Some(Uncertainty {
            innovation: 0.5,
            residual: 0.25,
            bound: 2.0,
            max_innovation: 1.0,
        }),
        partial: Some(PackedPartialLoss {
            loss: &[0; 64],
            bound: bound.as_flattened(),
        }),
        ..RecipeParts::new(&pattern, recipe.method().into())
    };
    let mut buffer = vec![0; 1 << 16];
    Recipe::write(&parts, &mut buffer).unwrap().to_vec()
}

/// Fits the first readings with core. Returns the bits of the values, and the bound of the loss.
fn fit_first_with_core(recipe: &[u8], count: u16) -> (Vec<u32>, f32) {
    let mut memory = vec![0.0; WORDS];
    let recipe = Recipe::parse(recipe).unwrap();
    let mut scan = Scan::<Fitter>::new(recipe, &mut memory).unwrap();
    for index in 0..count {
        scan.record(index, reading(index).into()).unwrap();
    }
    let mut fit = scan.fit().unwrap();
    while !fit.advance(u32::MAX).is_complete() {}
    let fitted = fit.finish().unwrap();
    let values = fitted.values().map(f32::to_bits).collect();
    (values, fitted.loss_bound().unwrap())
}

/// A scan stops at the first reading after which the bound is at most the target.
#[test]
fn driver_stops_at_target_loss() {
    let recipe = recipe_with_bounds();
    let fits: Vec<_> = (1..=16)
        .map(|count| fit_first_with_core(&recipe, count))
        .collect();
    let mut memory = AlignedMemory::for_driver();
    let mut config = glimpse_config_default(glimpse_host::Absent as i32);
    assert_eq!(config.target_loss, 0.0);
    let mut counts = Vec::new();
    for target in fits.iter().map(|(_, bound)| *bound).chain([0.0]) {
        config.target_loss = target;
        let driver = begin_with(&mut memory, &recipe, &config, &[]);
        let mut count = 0;
        loop {
            let action = poll(driver);
            match action.kind {
                Kind::Measure => {
                    assert_eq!(usize::from(action.index), count);
                    count += 1;
                    let reading = reading(action.index);
                    let status =
                        unsafe { glimpse_driver_record(driver, action.index, &raw const reading) };
                    assert_eq!(status, Status::Ok);
                }
                Kind::Finished => break,
                Kind::Failed => panic!("{:?}", action.failure),
                _ => {}
            }
        }
        let expected = fits.iter().position(|(_, bound)| *bound <= target);
        let expected = expected.unwrap_or(15);
        assert_eq!(count, expected + 1);
        assert_eq!(values(driver), fits[expected].0);
        counts.push(count);
    }
    assert_eq!(counts.last(), Some(&16));
    counts.dedup();
    assert!(counts.len() > 4, "{counts:?}");
}
