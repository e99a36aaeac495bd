//! The whole firmware on a host: the simulated scanner, a flash with power cuts, and no board.

use std::collections::BTreeMap;

use crate::support::{CUT_EFFECTS, Flash, mount_readings, mount_recipes};
use glimpse_arms::axis::AxisError;
use glimpse_arms::scanner::{
    Command, Event, Outcome, Platform, Scanner, ScannerError, Seeds, StartMode,
};
use glimpse_arms::simulated::{
    DirectionPin, Lamp, Photodiode, SimulatedScanner, StepPin, Switch, Wiring,
};
use glimpse_arms::station::StationError;
use glimpse_arms::store::StoreError;
use glimpse_arms::{MEMORY_WORDS, Model, retained};
use glimpse_core::driver::Host;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Reading, Residual, Scan};

static RECIPE: &[u8] = include_bytes!("../../../../trainer/recipes/phong-n8.recipe");

/// State that survives a reset: the machine, the flash, and the retained words.
struct Rig {
    simulated: SimulatedScanner,
    flash: Flash,
    retained: [u32; retained::WORDS],
}

/// Reports of a firmware until its end or a power cut.
#[derive(Debug, Default)]
struct Log {
    events: Vec<Event>,
    values: Vec<f32>,
    residual: Option<Residual>,
}

/// Panic payload of a power cut.
struct PowerOff;

struct TestPlatform<'b> {
    /// Given in the first iteration.
    command: Option<Command>,
    retained: &'b mut [u32; retained::WORDS],
    log: &'b mut Log,
    /// Receives all events; true cuts the power.
    watch: &'b mut dyn FnMut(&Event) -> bool,
}

impl Platform for TestPlatform<'_> {
    fn elapsed_us(&mut self) -> u32 {
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

    fn save_positions(&mut self, positions: Option<[i32; 4]>) {
        *self.retained = retained::encode(positions);
    }

    fn report(&mut self, event: Event) {
        self.log.events.push(event);
        if (self.watch)(&event) {
            std::panic::panic_any(PowerOff);
        }
    }

    fn report_fit(&mut self, residual: Residual, values: &mut dyn Iterator<Item = f32>) {
        self.log.values = values.collect();
        self.log.residual = Some(residual);
    }
}

type Simulated<'w> =
    Scanner<StepPin<'w>, DirectionPin<'w>, Switch<'w>, Photodiode<'w>, Lamp<'w>, Flash>;

impl Rig {
    fn new() -> Self {
        Self {
            simulated: SimulatedScanner::new([300, 500, 40, 700]),
            flash: Flash::new(6),
            retained: [0; retained::WORDS],
        }
    }

    /// Boots the firmware, which scans once. `watch` receives all events and the number of readings so far; true cuts
    /// the power.
    fn scan(
        &mut self,
        command: Command,
        mut watch: impl FnMut(&SimulatedScanner, &Event, usize) -> bool,
    ) -> (Log, Option<Outcome>) {
        let Self {
            simulated,
            flash,
            retained,
        } = self;
        let mut log = Log::default();
        let mut station = simulated.station();
        if let Some(positions) = retained::decode(*retained) {
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
        let mut platform = TestPlatform {
            command: Some(command),
            retained,
            log: &mut log,
            watch: &mut |event| {
                reads += usize::from(matches!(event, Event::Read { .. }));
                watch(simulated, event, reads)
            },
        };
        let run = std::panic::AssertUnwindSafe(|| {
            scanner.scan::<Model>(
                RECIPE,
                &mut memory,
                Host::Absent,
                StartMode::OnCommand,
                &mut platform,
            )
        });
        let outcome = match std::panic::catch_unwind(run) {
            Ok(outcome) => Some(outcome),
            Err(payload) if payload.is::<PowerOff>() => None,
            Err(panic) => std::panic::resume_unwind(panic),
        };
        *flash = scanner.flash;
        (log, outcome)
    }
}

fn readings(log: &Log) -> Vec<(u16, Reading)> {
    let read = |event: &Event| match event {
        Event::Read { index, reading } => Some((*index, *reading)),
        _ => None,
    };
    log.events.iter().filter_map(read).collect()
}

fn sorted_indices(readings: &[(u16, Reading)]) -> Vec<u16> {
    let mut indices: Vec<u16> = readings.iter().map(|(index, _)| *index).collect();
    indices.sort_unstable();
    indices
}

/// Fits the last reading of each sample, as a host does.
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
    let lost = |event: &Event| match event {
        Event::LostSteps(lost) => Some((lost.arm, lost.steps)),
        _ => None,
    };
    log.events.iter().filter_map(lost).collect()
}

#[test]
fn scan_reads_each_sample_once_and_matches_host_fit() {
    let mut rig = Rig::new();
    let (log, outcome) = rig.scan(Command::NewScan, |_, _, _| false);
    assert_eq!(outcome, Some(Outcome::Finished));
    let read = readings(&log);
    let order: Vec<u16> = read.iter().map(|(index, _)| *index).collect();
    assert!(!order.is_sorted(), "the nearest sample is next");
    assert_eq!(sorted_indices(&read), [0, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(log.values, fit(&read));
    assert_eq!(lost(&log), []);
}

/// Readings are the BRDF of the simulated material.
#[test]
fn readings_match_brdf_of_material() {
    let mut rig = Rig::new();
    let (log, _) = rig.scan(Command::NewScan, |_, _, _| false);
    let recipe = Recipe::parse(RECIPE).unwrap();
    for (index, reading) in readings(&log) {
        let angles = recipe.pattern().nth(index.into()).unwrap();
        let lobe = |sharpness: f32| (1.0 + sharpness * angles.theta_h.powi(2)).powi(-2);
        let highlight = 0.1 * (8.0 * lobe(40.0) + lobe(4.0)) * (1.0 + 0.2 * angles.theta_d.powi(2));
        let expected = [0.12 + highlight, 0.05 + highlight, 0.03 + 0.9 * highlight];
        for (found, expected) in reading.brdf.into_iter().zip(expected) {
            // Tolerance of a 12-bit count, a little noise, and a step of 0.03 degrees.
            let close = 0.01 * expected + 0.01;
            assert!(
                (found - expected).abs() < close,
                "{index}: {found} {expected}"
            );
        }
    }
}

/// Resets after every second event, in one scan.
#[test]
fn no_sample_is_read_twice_after_resets() {
    let mut rig = Rig::new();
    let mut all = Vec::new();
    let mut command = Command::NewScan;
    for resets in 1.. {
        let mut count = 0;
        let (log, outcome) = rig.scan(command, |_, event, _| {
            // These events alone would reset it before its first reading.
            count += u32::from(!matches!(
                event,
                Event::Resumed | Event::Home { confirmed: 0 }
            ));
            count == 2
        });
        all.extend(readings(&log));
        command = Command::Continue;
        assert_eq!(lost(&log), []);
        if let Some(outcome) = outcome {
            assert_eq!(outcome, Outcome::Finished);
            assert_eq!(log.values, fit(&all));
            assert!(resets > 4, "{resets}");
            break;
        }
    }
    assert_eq!(sorted_indices(&all), [0, 1, 2, 3, 4, 5, 6, 7]);
}

#[test]
fn finished_scan_is_not_resumed() {
    let mut rig = Rig::new();
    rig.scan(Command::NewScan, |_, _, _| false);
    let readings = mount_readings(&mut rig.flash);
    let recipe = Recipe::parse(RECIPE).unwrap();
    assert!(!readings.is_under_way(recipe.checksum(), 8));
}

/// After the sixth reading the azimuth of the sensor loses steps. Samples since the last homing are read again,
/// earlier ones are not.
#[test]
fn lost_steps_repeat_only_affected_samples() {
    let mut rig = Rig::new();
    let (log, outcome) = rig.scan(Command::NewScan, |simulated, event, reads| {
        if reads == 6 && matches!(event, Event::Read { .. }) {
            simulated.stall(3, 40);
        }
        false
    });
    assert_eq!(outcome, Some(Outcome::Finished));
    let [(3, steps)] = lost(&log)[..] else {
        panic!("{:?}", log.events);
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

/// Homing after a reset detects wrong step counts from before.
#[test]
fn steps_lost_before_reset_are_detected() {
    let mut rig = Rig::new();
    let (before, outcome) = rig.scan(Command::NewScan, |simulated, _, reads| {
        if reads == 1 {
            simulated.stall(1, 40);
        }
        reads == 3
    });
    assert_eq!(outcome, None);
    let (after, outcome) = rig.scan(Command::Continue, |_, _, _| false);
    assert_eq!(outcome, Some(Outcome::Finished));
    assert_eq!(lost(&after).len(), 1);
    assert_eq!(readings(&before).len() + readings(&after).len(), 3 + 8);
    assert_eq!(after.values, fit(&readings(&after)));
}

/// A power cut in each write and each erase of a whole scan. At most the reading that was being saved is taken again.
#[test]
fn scan_survives_power_cut_in_every_write() {
    for change in 1.. {
        let mut rig = Rig::new();
        let effect = CUT_EFFECTS[change as usize % CUT_EFFECTS.len()];
        rig.flash.cut = Some((change, effect));
        let (before, outcome) = rig.scan(Command::NewScan, |_, _, _| false);
        if outcome == Some(Outcome::Finished) {
            assert!(change > 14, "{change}");
            return;
        }
        assert_eq!(
            outcome,
            Some(Outcome::Failed(ScannerError::Store(StoreError::Flash)))
        );
        rig.flash.cut = None;
        rig.retained = retained::encode(None);
        let command = match readings(&before).len() {
            0 => Command::NewScan,
            _ => Command::Continue,
        };
        let (after, outcome) = rig.scan(command, |_, _, _| false);
        if outcome.is_none() || after.values.is_empty() {
            // The last write has already ended the scan.
            assert_eq!(before.values.len(), after.values.len());
            continue;
        }
        assert_eq!(outcome, Some(Outcome::Finished));
        let all = [readings(&before), readings(&after)].concat();
        assert_eq!(after.values, fit(&all));
        assert!(
            all.len() <= 8,
            "{} readings after a cut in change {change}",
            all.len()
        );
    }
}

/// Readings survive a power cut, step counts do not.
#[test]
fn scan_resumes_with_unknown_positions_after_power_cut() {
    let mut rig = Rig::new();
    let (before, _) = rig.scan(Command::NewScan, |_, _, reads| reads == 6);
    rig.retained = [0x5A5A_5A5A; retained::WORDS];
    rig.simulated.reset([20, 900, 333, 1]);
    let (after, outcome) = rig.scan(Command::Continue, |_, _, _| false);
    assert_eq!(outcome, Some(Outcome::Finished));
    let all = [readings(&before), readings(&after)].concat();
    assert_eq!(all.len(), 8);
    assert_eq!(after.values, fit(&all));
}

#[test]
fn repeated_step_loss_ends_scan() {
    let mut rig = Rig::new();
    let (_, outcome) = rig.scan(Command::NewScan, |simulated, event, _| {
        if matches!(event, Event::Read { .. }) {
            simulated.stall(0, 60);
        }
        false
    });
    let Some(Outcome::Failed(ScannerError::LostSteps(lost))) = outcome else {
        panic!("{outcome:?}");
    };
    assert_eq!(lost.arm, 0);
}

#[test]
fn disconnected_motor_ends_scan() {
    let mut rig = Rig::new();
    rig.simulated.stall(2, u32::MAX);
    let (_, outcome) = rig.scan(Command::NewScan, |_, _, _| false);
    let Some(Outcome::Failed(ScannerError::Station(StationError::Arm(error)))) = outcome else {
        panic!("{outcome:?}");
    };
    assert_eq!((error.arm, error.error), (2, AxisError::HomeNotFound));
}

/// The arm may have hit something, so it does not go home automatically.
#[test]
fn switch_opening_during_move_ends_scan() {
    let mut rig = Rig::new();
    let (log, outcome) = rig.scan(Command::NewScan, |simulated, event, reads| {
        if reads == 2 && matches!(event, Event::Read { .. }) {
            simulated.set_wiring(3, Wiring::Broken);
        }
        false
    });
    let Some(Outcome::Failed(ScannerError::Station(StationError::Arm(error)))) = outcome else {
        panic!("{outcome:?}");
    };
    assert_eq!(error.arm, 3);
    assert!(matches!(error.error, AxisError::SwitchOpened { .. }));
    assert_eq!(readings(&log).len(), 2);
    assert_eq!(rig.retained, retained::encode(None));
}
