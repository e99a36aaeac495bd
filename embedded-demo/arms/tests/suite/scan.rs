//! The whole firmware on a host: the simulated scanner, a flash whose power may go, and no board.

use std::collections::BTreeMap;

use crate::support::{Flash, LEAVES, mount_readings, mount_recipes};
use glimpse_arms::axis::AxisError;
use glimpse_arms::scanner::{Command, End, News, Platform, Scanner, ScannerError, Seeds, Start};
use glimpse_arms::simulated::{DirectionPin, Lamp, Photodiode, StepPin, Switch, Wiring, World};
use glimpse_arms::station::StationError;
use glimpse_arms::store::StoreError;
use glimpse_arms::{MEMORY_WORDS, Model, retained};
use glimpse_core::driver::Host;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Reading, Residual, Scan};

static RECIPE: &[u8] = include_bytes!("../../../../trainer/recipes/phong-n8.recipe");

/// The things that outlast a reset: the machine, the flash, and some words of memory.
struct Bench {
    world: World,
    flash: Flash,
    retained: [u32; retained::WORDS],
}

/// The reports of a firmware until it ended, or until the bench pulled the plug.
#[derive(Debug, Default)]
struct Log {
    news: Vec<News>,
    values: Vec<f32>,
    residual: Option<Residual>,
}

/// The plug is pulled.
struct Pulled;

struct Around<'b> {
    /// Given in the first round.
    command: Option<Command>,
    retained: &'b mut [u32; retained::WORDS],
    log: &'b mut Log,
    /// Receives all news; true pulls the plug.
    watch: &'b mut dyn FnMut(&News) -> bool,
}

impl Platform for Around<'_> {
    fn elapsed(&mut self) -> u32 {
        10
    }

    fn receive(&mut self) -> Option<u8> {
        None
    }

    fn send(&mut self, _: u8) -> bool {
        true
    }

    fn command(&mut self) -> Option<Command> {
        self.command.take()
    }

    fn remember(&mut self, positions: Option<[i32; 4]>) {
        *self.retained = retained::words(positions);
    }

    fn tell(&mut self, news: News) {
        self.log.news.push(news);
        if (self.watch)(&news) {
            std::panic::panic_any(Pulled);
        }
    }

    fn finished(&mut self, residual: Residual, values: &mut dyn Iterator<Item = f32>) {
        self.log.values = values.collect();
        self.log.residual = Some(residual);
    }
}

type Simulated<'w> =
    Scanner<StepPin<'w>, DirectionPin<'w>, Switch<'w>, Photodiode<'w>, Lamp<'w>, Flash>;

impl Bench {
    fn new() -> Self {
        Self {
            world: World::new([300, 500, 40, 700]),
            flash: Flash::new(6),
            retained: [0; retained::WORDS],
        }
    }

    /// Boots the firmware, which scans once; `watch` receives all news, and the number of
    /// readings until then; it pulls the plug by true.
    fn scan(
        &mut self,
        command: Command,
        mut watch: impl FnMut(&World, &News, usize) -> bool,
    ) -> (Log, Option<End>) {
        let Self {
            world,
            flash,
            retained,
        } = self;
        let mut log = Log::default();
        let mut station = world.station();
        if let Some(positions) = retained::positions(*retained) {
            station.assume(positions);
        }
        let mut scanner: Simulated<'_> = Scanner {
            station,
            readings: mount_readings(flash),
            recipes: mount_recipes(flash),
            flash: flash.clone(),
            seeds: Seeds::new(0),
        };
        let mut memory = [0.0; MEMORY_WORDS];
        let mut reads = 0;
        let mut around = Around {
            command: Some(command),
            retained,
            log: &mut log,
            watch: &mut |news| {
                reads += usize::from(matches!(news, News::Read { .. }));
                watch(world, news, reads)
            },
        };
        let run = std::panic::AssertUnwindSafe(|| {
            scanner.scan::<Model>(
                RECIPE,
                &mut memory,
                Host::Absent,
                Start::OnCommand,
                &mut around,
            )
        });
        let end = match std::panic::catch_unwind(run) {
            Ok(end) => Some(end),
            Err(pulled) if pulled.is::<Pulled>() => None,
            Err(panic) => std::panic::resume_unwind(panic),
        };
        *flash = scanner.flash;
        (log, end)
    }
}

fn readings(log: &Log) -> Vec<(u16, Reading)> {
    let read = |news: &News| match news {
        News::Read { index, reading } => Some((*index, *reading)),
        _ => None,
    };
    log.news.iter().filter_map(read).collect()
}

fn sorted_indices(readings: &[(u16, Reading)]) -> Vec<u16> {
    let mut indices: Vec<u16> = readings.iter().map(|(index, _)| *index).collect();
    indices.sort_unstable();
    indices
}

/// A host's fit of the last reading of each sample.
fn fit(readings: &[(u16, Reading)]) -> Vec<f32> {
    let last: BTreeMap<_, _> = readings.iter().copied().collect();
    let mut memory = [0.0; MEMORY_WORDS];
    let mut scan = Scan::<Model>::new(Recipe::parse(RECIPE).unwrap(), &mut memory).unwrap();
    for (index, reading) in last {
        scan.record(index, reading).unwrap();
    }
    let mut fit = scan.fit().unwrap();
    while !fit.advance(u32::MAX).is_complete() {}
    fit.finish().unwrap().values().collect()
}

fn lost(log: &Log) -> Vec<(u8, i32)> {
    let lost = |news: &News| match news {
        News::LostSteps(lost) => Some((lost.arm, lost.steps)),
        _ => None,
    };
    log.news.iter().filter_map(lost).collect()
}

#[test]
fn a_scan_reads_every_sample_once_and_fits_what_a_host_fits() {
    let mut bench = Bench::new();
    let (log, end) = bench.scan(Command::NewScan, |_, _, _| false);
    assert_eq!(end, Some(End::Finished));
    let read = readings(&log);
    let order: Vec<u16> = read.iter().map(|(index, _)| *index).collect();
    assert!(!order.is_sorted(), "the nearest one is next");
    assert_eq!(sorted_indices(&read), [0, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(log.values, fit(&read));
    assert_eq!(lost(&log), []);
}

/// Counts, dark and white end in the BRDF of the material that lies there.
#[test]
fn readings_are_brdfs() {
    let mut bench = Bench::new();
    let (log, _) = bench.scan(Command::NewScan, |_, _, _| false);
    let recipe = Recipe::parse(RECIPE).unwrap();
    for (index, reading) in readings(&log) {
        let angles = recipe.pattern().nth(index.into()).unwrap();
        let lobe = |sharpness: f32| (1.0 + sharpness * angles.theta_h.powi(2)).powi(-2);
        let highlight = 0.1 * (8.0 * lobe(40.0) + lobe(4.0)) * (1.0 + 0.2 * angles.theta_d.powi(2));
        let expected = [0.12 + highlight, 0.05 + highlight, 0.03 + 0.9 * highlight];
        for (found, expected) in reading.brdf.into_iter().zip(expected) {
            // A count of twelve bits, a little noise, and a step of 0.03 degrees.
            let close = 0.01 * expected + 0.01;
            assert!(
                (found - expected).abs() < close,
                "{index}: {found} {expected}"
            );
        }
    }
}

/// Resets after each of the news, in one scan.
#[test]
fn resets_anywhere_measure_nothing_twice() {
    let mut bench = Bench::new();
    let mut all = Vec::new();
    let mut command = Command::NewScan;
    for resets in 1.. {
        let mut count = 0;
        let (log, end) = bench.scan(command, |_, news, _| {
            // Not right at the beginning, or it never gets anywhere.
            count += u32::from(!matches!(news, News::GoesOn | News::Home { confirmed: 0 }));
            count == 2
        });
        all.extend(readings(&log));
        command = Command::Continue;
        assert_eq!(lost(&log), []);
        if let Some(end) = end {
            assert_eq!(end, End::Finished);
            assert_eq!(log.values, fit(&all));
            assert!(resets > 4, "{resets}");
            break;
        }
    }
    assert_eq!(sorted_indices(&all), [0, 1, 2, 3, 4, 5, 6, 7]);
}

#[test]
fn what_is_over_is_not_gone_on_with() {
    let mut bench = Bench::new();
    bench.scan(Command::NewScan, |_, _, _| false);
    let readings = mount_readings(&mut bench.flash);
    let recipe = Recipe::parse(RECIPE).unwrap();
    assert!(!readings.is_under_way(recipe.checksum(), 8));
}

/// After the sixth reading the azimuth of the sensor loses steps: what was read since the arms were
/// home is read again, and what was read before is not.
#[test]
fn lost_steps_are_found_and_only_what_they_spoilt_is_read_again() {
    let mut bench = Bench::new();
    let (log, end) = bench.scan(Command::NewScan, |world, news, reads| {
        if reads == 6 && matches!(news, News::Read { .. }) {
            world.stall(3, 40);
        }
        false
    });
    assert_eq!(end, Some(End::Finished));
    let [(3, steps)] = lost(&log)[..] else {
        panic!("{:?}", log.news);
    };
    assert_eq!(steps.abs(), 40);
    let read = readings(&log);
    let mut times = BTreeMap::<u16, u32>::new();
    for (index, _) in &read {
        *times.entry(*index).or_default() += 1;
    }
    let once = sorted_indices(&read[..4]);
    for (index, times) in times {
        assert_eq!(times, if once.contains(&index) { 1 } else { 2 });
    }
    assert_eq!(log.values, fit(&read));
}

/// A reset hides nothing: the arms come home, and the counts from before were wrong.
#[test]
fn steps_that_were_lost_before_a_reset_are_found_after_it() {
    let mut bench = Bench::new();
    let (before, end) = bench.scan(Command::NewScan, |world, _, reads| {
        if reads == 1 {
            world.stall(1, 40);
        }
        reads == 3
    });
    assert_eq!(end, None);
    let (after, end) = bench.scan(Command::Continue, |_, _, _| false);
    assert_eq!(end, Some(End::Finished));
    assert_eq!(lost(&after).len(), 1);
    assert_eq!(readings(&before).len() + readings(&after).len(), 3 + 8);
    assert_eq!(after.values, fit(&readings(&after)));
}

/// The power goes in each write and each erase of a whole scan. At most the reading that was being
/// kept is taken again.
#[test]
fn power_cuts_in_every_write_end_in_the_same_scan() {
    for change in 1.. {
        let mut bench = Bench::new();
        let leaves = LEAVES[change as usize % LEAVES.len()];
        bench.flash.cut = Some((change, leaves));
        let (before, end) = bench.scan(Command::NewScan, |_, _, _| false);
        if end == Some(End::Finished) {
            assert!(change > 14, "{change}");
            return;
        }
        assert_eq!(
            end,
            Some(End::Failed(ScannerError::Store(StoreError::Flash)))
        );
        bench.flash.cut = None;
        bench.retained = retained::words(None);
        let command = match readings(&before).len() {
            0 => Command::NewScan,
            _ => Command::Continue,
        };
        let (after, end) = bench.scan(command, |_, _, _| false);
        if end.is_none() || after.values.is_empty() {
            // The very last write said that the scan is over.
            assert_eq!(before.values.len(), after.values.len());
            continue;
        }
        assert_eq!(end, Some(End::Finished));
        let all = [readings(&before), readings(&after)].concat();
        assert_eq!(after.values, fit(&all));
        assert!(
            all.len() <= 8,
            "{} readings after a cut in change {change}",
            all.len()
        );
    }
}

/// Readings outlast a power cut, which no count does.
#[test]
fn after_a_power_cut_the_scan_goes_on_though_nobody_knows_where_the_arms_are() {
    let mut bench = Bench::new();
    let (before, _) = bench.scan(Command::NewScan, |_, _, reads| reads == 6);
    bench.retained = [0x5A5A_5A5A; retained::WORDS];
    bench.world.place([20, 900, 333, 1]);
    let (after, end) = bench.scan(Command::Continue, |_, _, _| false);
    assert_eq!(end, Some(End::Finished));
    let all = [readings(&before), readings(&after)].concat();
    assert_eq!(all.len(), 8);
    assert_eq!(after.values, fit(&all));
}

#[test]
fn an_arm_that_loses_steps_for_ever_ends_the_scan_by_name() {
    let mut bench = Bench::new();
    let (_, end) = bench.scan(Command::NewScan, |world, news, _| {
        if matches!(news, News::Read { .. }) {
            world.stall(0, 60);
        }
        false
    });
    let Some(End::Failed(ScannerError::LostSteps(lost))) = end else {
        panic!("{end:?}");
    };
    assert_eq!(lost.arm, 0);
}

#[test]
fn a_motor_that_is_not_connected_ends_the_scan_by_name() {
    let mut bench = Bench::new();
    bench.world.stall(2, u32::MAX);
    let (_, end) = bench.scan(Command::NewScan, |_, _, _| false);
    let Some(End::Failed(ScannerError::Station(StationError::Arm(error)))) = end else {
        panic!("{end:?}");
    };
    assert_eq!((error.arm, error.error), (2, AxisError::HomeNotFound));
}

/// The arm may have hit somebody, so it does not go home by itself.
#[test]
fn a_switch_that_opens_during_a_move_ends_the_scan() {
    let mut bench = Bench::new();
    let (log, end) = bench.scan(Command::NewScan, |world, news, reads| {
        if reads == 2 && matches!(news, News::Read { .. }) {
            world.wire(3, Wiring::Broken);
        }
        false
    });
    let Some(End::Failed(ScannerError::Station(StationError::Arm(error)))) = end else {
        panic!("{end:?}");
    };
    assert_eq!(error.arm, 3);
    assert!(matches!(error.error, AxisError::SwitchOpened { .. }));
    assert_eq!(readings(&log).len(), 2);
    assert_eq!(bench.retained, retained::words(None));
}
