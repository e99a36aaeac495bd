//! Calls that the C examples do not make, or whose results they do not print.

use core::mem::zeroed;
use core::ptr::{null, null_mut};
use std::vec;
use std::vec::Vec;

use glimpse_core::driver::{Action, Config, Host};
use glimpse_core::link::{FRAME_BYTES, HostEnd, PROTOCOL, Purpose, Reply};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;

use super::{AlignedMemory, MASKED, PHONG, WORDS, begin, begin_driver, reading};
use crate::driver::*;
use crate::fit::*;
use crate::handle::{ScanModel, glimpse_driver};
use crate::scan::*;
use crate::status::glimpse_status as Status;
use crate::types::{glimpse_action, glimpse_action_kind as Kind, glimpse_host, glimpse_purpose};

#[test]
fn recipes_and_partial_scans_match_core() {
    let (mut memory, mut words) = (AlignedMemory::for_scan(), vec![0.0; WORDS]);
    let recipe = Recipe::parse(MASKED).unwrap();
    let mut core = Scan::<ScanModel>::new(recipe, &mut words).unwrap();
    let (_, scan) = begin(&mut memory, MASKED);
    for index in 0..5 {
        let reading = reading(index);
        core.record(index, reading).unwrap();
        let reading = reading.into();
        let status = unsafe { glimpse_scan_record(scan, index, &raw const reading, null_mut()) };
        assert_eq!(status, Status::Ok);
    }
    core.finish_early().unwrap();
    let mut fit = core.fit().unwrap();
    while !fit.advance(99).is_complete() {}
    let expected = fit.finish().unwrap();
    unsafe {
        let (mut sample, mut fitted, mut described) = (zeroed(), zeroed(), zeroed());
        let skipped = [
            glimpse_scan_skip(scan, 5),
            glimpse_scan_next(scan, 5, &raw mut sample),
        ];
        assert_eq!((skipped, sample.index), ([Status::Ok; 2], 6));
        let finished = [
            glimpse_scan_finish_early(scan),
            glimpse_fit_begin(scan),
            glimpse_fit_advance(scan, u32::MAX, null_mut()),
            glimpse_fit_finish(scan),
            glimpse_fitted_describe(scan, &raw mut fitted),
            glimpse_recipe_describe(MASKED.as_ptr(), MASKED.len(), &raw mut described),
        ];
        assert_eq!(finished, [Status::Ok; 6]);
        assert_eq!(
            glimpse_scan_next(scan, 0, &raw mut sample),
            Status::NonePending
        );
        assert_eq!(fitted.residual.worst_index, expected.residual().worst_index);
        assert_eq!(Some(fitted.loss_bound), expected.loss_bound());
        assert!(fitted.residual.dark.is_nan() && fitted.residual.drift.is_nan());
        assert_eq!((described.model, described.samples), (0, 16));
        assert_eq!(usize::from(described.values), recipe.values());
        assert_eq!(described.checksum, recipe.checksum());
        assert_eq!(Some(described.expected_loss), recipe.expected_loss());
    }
}

fn poll(driver: *mut glimpse_driver, now: u32) -> glimpse_action {
    let mut action = unsafe { zeroed() };
    let status = unsafe { glimpse_driver_poll(driver, now, &raw mut action) };
    assert_eq!(status, Status::Ok);
    action
}

fn poll_delay(driver: *mut glimpse_driver, now: u32) -> u32 {
    let mut delay = 0;
    let status = unsafe { glimpse_driver_poll_delay(driver, now, &raw mut delay) };
    assert_eq!(status, Status::Ok);
    delay
}

/// Sends up to `most` bytes.
fn send(driver: *mut glimpse_driver, most: usize) -> Vec<u8> {
    let (mut bytes, mut count) = (null(), 0);
    unsafe {
        let status = glimpse_driver_outgoing(driver, &raw mut bytes, &raw mut count);
        assert_eq!(status, Status::Ok);
        let sent = core::slice::from_raw_parts(bytes, count.min(most)).to_vec();
        assert_eq!(glimpse_driver_sent(driver, most), Status::Ok);
        sent
    }
}

/// A driver greets a host, and asks for a reading once the host has answered.
#[test]
fn driver_exchanges_bytes() {
    let mut memory = AlignedMemory::for_driver();
    let config = glimpse_config_default(glimpse_host::Listens as i32);
    let (_, driver) = begin_driver(&mut memory, PHONG, &config);
    assert_eq!(poll(driver, 30).kind, Kind::Wait);
    let frame = [send(driver, 3), send(driver, usize::MAX)].concat();
    assert_eq!(poll(driver, 30).kind, Kind::Wait);
    assert_eq!(poll_delay(driver, 90), 40);
    let (mut end, mut buffer, mut replies) = (HostEnd::default(), [0; FRAME_BYTES], Vec::new());
    for byte in frame {
        let welcome = |_| Some(Reply::Welcome { protocol: PROTOCOL });
        replies.extend(end.answer(byte, &mut buffer, welcome).unwrap_or(&[]));
    }
    let status = unsafe { glimpse_driver_receive(driver, replies.as_ptr(), replies.len()) };
    assert_eq!(status, Status::Ok);
    let mut actions = (0..9).map(|_| poll(driver, 30));
    let measure = actions.find(|action| action.kind == Kind::Measure);
    assert_eq!(measure.unwrap().purpose, glimpse_purpose::Dark as i32);
}

/// A host that listens does not reply while the clock wraps.
#[test]
fn time_wraps() {
    let mut memory = AlignedMemory::for_driver();
    let config = glimpse_config_default(glimpse_host::Listens as i32);
    let (_, driver) = begin_driver(&mut memory, PHONG, &config);
    let (mut passed, mut sent_at) = (0_u32, Vec::new());
    loop {
        let now = passed.wrapping_sub(250);
        if poll(driver, now).kind == Kind::Measure {
            break;
        }
        if !send(driver, usize::MAX).is_empty() {
            sent_at.push(passed);
        }
        passed += poll_delay(driver, now);
    }
    assert_eq!(passed, config.reply_timeout_ms);
    assert!(sent_at.into_iter().eq((0..passed).step_by(100)));
}

#[test]
fn options_and_actions_have_all_fields() {
    let mut c = glimpse_config_default(glimpse_host::Measures as i32);
    let mut config = Config::new(Host::Measures);
    (c.sequence_seed, config.sequence_seed) = (1, 1);
    (c.max_dark, c.max_drift, c.max_saturated) = (0.1, 0.2, 0.3);
    (
        config.limits.dark,
        config.limits.drift,
        config.limits.saturated,
    ) = (0.1, 0.2, 0.3);
    (c.target_loss, config.target_loss) = (0.5, Some(0.5));
    assert_eq!(c.validated(), Ok(config));

    let (index, reading) = (3, Some(reading(3)));
    let save = glimpse_action::from(Action::Save { index, reading });
    assert_eq!((save.index, save.has_reading), (3, 1));
    assert_eq!(Some(save.reading), reading.map(From::from));
    let reading = None;
    let skip = glimpse_action::from(Action::Save { index, reading });
    assert_eq!((skip.index, skip.has_reading), (3, 0));
    let purposes = [Purpose::Sample, Purpose::Dark, Purpose::Again];
    let (index, directions) = (3, Default::default());
    for (purpose, number) in purposes.into_iter().zip(0..) {
        let measure = Action::Measure {
            purpose,
            index,
            directions,
        };
        assert_eq!(glimpse_action::from(measure).purpose, number);
    }
}
