//! Times of scans over a line that loses bytes, with a device that resets: prints the table of core/docs/faults.md.

use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::link::Request;
use glimpse_core::model::ModelKind;
use glimpse_core::store::{Layout, Store};

use super::bench::*;
use crate::documents::recovery::common::flash::Flash;
use crate::random::Random;
use crate::scanning::*;

/// Scans for each row.
const SCANS: u64 = 20;
/// The time of a reading by the host, in ms.
const READING_MS: u64 = 3_000;
/// The longest scan, in ms.
const LIMIT_MS: u64 = 1_800_000;

/// Returns the seconds of a scan of eight readings; None if it takes too long. The device resets `resets` times, each
/// during a reading.
fn scan_seconds(lost_per_thousand: u64, resets: usize, seed: u64) -> Option<f64> {
    let recipe = recipe_for(ModelKind::Neural);
    let expected = full_scan::<Any>(recipe, synthetic_reading);
    let mut line = Random(seed);
    let mut bench = Bench::cooperative();
    bench.corrupt = Box::new(move |bytes| {
        let arrives = |_: &u8| line.bits() % 1000 >= lost_per_thousand;
        bytes.into_iter().filter(arrives).collect()
    });
    bench.delay = Box::new(|request| match request {
        Request::Measure { .. } => READING_MS,
        _ => 0,
    });
    let mut flash = Flash::new(2);
    let mut saves_until_reset: Vec<usize> = (1..=resets).collect();
    for boot in 0.. {
        let mut scan = new_scan::<Any>(recipe);
        let layout = Layout {
            start: 0,
            area_bytes: 512,
        };
        let mut store = Store::mount(&mut flash, layout, &recipe).unwrap();
        store.restore(&mut scan).unwrap();
        let mut config = Config::new(Host::Measures);
        config.sequence_seed = boot;
        let mut driver = Driver::new(scan, config);
        let saves = saves_until_reset.pop();
        for count in 1.. {
            let is_event =
                |action: &Action| matches!(action, Action::Save { .. }) || is_end(action);
            let (now, action) = bench.run(&mut driver, is_event);
            match action {
                _ if now > LIMIT_MS => return None,
                Action::Finished(_) => {
                    assert_eq!(fitted_bits(&driver), expected.bits());
                    return Some(now as f64 / 1000.0);
                }
                Action::Failed(_) => driver.resume(),
                Action::Save { index, reading } => store.save(index, reading, true).unwrap(),
                _ => {}
            }
            if saves == Some(count) {
                bench.wait(&mut driver, READING_MS / 2);
                break;
            }
        }
    }
    None
}

fn is_end(action: &Action) -> bool {
    is_finished(action) || is_failed(action)
}

/// Every scan ends with the bits of a scan without faults, if a byte in twenty or fewer are lost.
#[test]
fn scans_complete_despite_lost_bytes_and_resets() {
    println!("| lost bytes | resets | complete | mean time, s | longest, s |");
    println!("|---:|---:|---:|---:|---:|");
    for (lost, resets) in [
        (0, 0),
        (1, 0),
        (10, 0),
        (30, 0),
        (50, 0),
        (0, 1),
        (0, 3),
        (10, 3),
    ] {
        let scans = (0..SCANS).filter_map(|seed| scan_seconds(lost, resets, seed));
        let seconds: Vec<f64> = scans.collect();
        let (count, sum) = (seconds.len(), seconds.iter().sum::<f64>());
        let longest = seconds.iter().copied().fold(0.0, f64::max);
        println!(
            "| {} % | {resets} | {count} of {SCANS} | {:.1} | {longest:.1} |",
            lost as f64 / 10.0,
            sum / count as f64
        );
        assert_eq!(count as u64, SCANS);
    }
}
