//! Calls that the C examples do not make, or whose results they do not print.

use core::mem::zeroed;
use core::ptr::{null, null_mut};
use std::vec;
use std::vec::Vec;

use glimpse_core::driver::{Action, Config, Host};
use glimpse_core::link::{FRAME_BYTES, PROTOCOL, RecipeBytes, Reply, Server};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;

use super::{AlignedMemory, MASKED, PHONG, WORDS, begin, begin_driver, reading};
use crate::driver::*;
use crate::fit::*;
use crate::handle::ScanModel;
use crate::scan::*;
use crate::status::glimpse_status as Status;
use crate::types::{glimpse_action, glimpse_action_kind as Kind, glimpse_host};

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
        assert_eq!((described.model, described.samples), (0, 16));
        assert_eq!(usize::from(described.values), recipe.values());
        assert_eq!(described.checksum, recipe.checksum());
        assert_eq!(Some(described.expected_loss), recipe.expected_loss());
    }
}

/// A driver greets a host, and asks for a reading once the host has answered.
#[test]
fn driver_exchanges_bytes() {
    let mut memory = AlignedMemory::for_driver();
    let config = glimpse_config_default(glimpse_host::Listens as i32);
    let (_, driver) = begin_driver(&mut memory, PHONG, &config);
    let poll = || unsafe {
        let (mut action, mut delay): (glimpse_action, _) = (zeroed(), 0);
        let status = glimpse_driver_poll(driver, 30, &raw mut action);
        assert_eq!(status, Status::Ok);
        let status = glimpse_driver_poll_delay(driver, 90, &raw mut delay);
        assert_eq!(status, Status::Ok);
        (action.kind, delay)
    };
    let send = |most: usize| unsafe {
        let (mut bytes, mut count) = (null(), 0);
        let status = glimpse_driver_outgoing(driver, &raw mut bytes, &raw mut count);
        assert_eq!(status, Status::Ok);
        let sent = core::slice::from_raw_parts(bytes, count.min(most)).to_vec();
        assert_eq!(glimpse_driver_sent(driver, most), Status::Ok);
        sent
    };
    assert_eq!(poll().0, Kind::Wait);
    let frame = [send(3), send(usize::MAX)].concat();
    assert_eq!(poll(), (Kind::Wait, 40));
    let (mut server, mut buffer, mut replies) = (Server::new(), [0; FRAME_BYTES], Vec::new());
    for byte in frame {
        let welcome = |_| Some(Reply::Welcome { protocol: PROTOCOL });
        replies.extend(server.answer(byte, &mut buffer, welcome).unwrap_or(&[]));
    }
    let status = unsafe { glimpse_driver_receive(driver, replies.as_ptr(), replies.len()) };
    assert_eq!(status, Status::Ok);
    let mut kinds = (0..9).map(|_| poll().0);
    assert!(kinds.any(|kind| kind == Kind::Measure));
}

#[test]
fn options_and_actions_have_all_fields() {
    let mut c = glimpse_config_default(glimpse_host::Measures as i32);
    let mut config = Config::new(Host::Measures);
    (c.sequence_seed, config.sequence_seed) = (1, 1);
    (c.recipe_bytes, config.recipe_bytes) = (2, 2);
    (c.target_loss, config.target_loss) = (0.5, Some(0.5));
    assert_eq!(c.validated(), Ok(config));

    let (index, reading) = (3, reading(3));
    let save = glimpse_action::from(Action::Save { index, reading });
    assert_eq!((save.index, save.reading), (3, reading.into()));
    let (bytes, checksum) = (130, 9);
    let install = glimpse_action::from(Action::Install { bytes, checksum });
    assert_eq!((install.offset, install.checksum), (130, 9));
    let (offset, bytes) = (60, RecipeBytes::from_iter([7, 8]));
    let store = glimpse_action::from(Action::Store { offset, bytes });
    assert_eq!((store.offset, store.byte_count), (60, 2));
    assert_eq!(store.bytes[..3], [7, 8, 0]);
}
