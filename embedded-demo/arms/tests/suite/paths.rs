//! Lamp and sensor never collide: at home, on every route, and at samples.

use std::f32::consts::{FRAC_PI_2, PI};

use crate::support::{Flash, mount_readings, mount_recipes};
use glimpse_arms::axis::Settings;
use glimpse_arms::route::{AxisAngles, RouteError, Space, separation_between};
use glimpse_arms::scanner::{Command, Event, Outcome, Platform, Scanner, Seeds, StartMode};
use glimpse_arms::simulated::{SimulatedScanner, settings};
use glimpse_arms::station::StationError;
use glimpse_arms::{MEMORY_WORDS, Model, retained};
use glimpse_core::driver::Host;
use glimpse_core::geometry::{ArmAngles, Spherical};
use glimpse_core::gonio::Limits;
use glimpse_core::scan::Residual;

static NEURAL: &[u8] = include_bytes!("../../../../trainer/recipes/neural-n8.recipe");
static COOK_TORRANCE: &[u8] = include_bytes!("../../../../trainer/recipes/cook-torrance-n8.recipe");

/// Limits of these tests: the samples of both recipes are at least this far apart.
const LIMITS: Limits = Limits {
    min_separation: 0.268,
    ..Limits::NONE
};
/// Error of the separation by rounding to steps, radians.
const ROUNDING: f32 = 1.2e-3;

fn separation([theta_i, phi_i, theta_o, phi_o]: AxisAngles) -> f32 {
    let at = |theta, phi| Spherical { theta, phi };
    let arms = ArmAngles {
        incoming: at(theta_i, phi_i),
        outgoing: at(theta_o, phi_o),
    };
    arms.directions().separation()
}

/// Receives all events; true cuts the power.
type Watch<'w> = Box<dyn FnMut(&Event) -> bool + 'w>;

/// A platform that observes the arms in each iteration.
struct Observer<'w> {
    simulated: &'w SimulatedScanner,
    limits: Limits,
    /// The minimum separation, and the angles there.
    closest: (f32, AxisAngles),
    retained: [u32; retained::WORDS],
    watch: Watch<'w>,
}

/// Panic payload of a power cut.
struct PowerOff;

impl Platform for Observer<'_> {
    fn elapsed_us(&mut self) -> u32 {
        let angles = self.simulated.angles();
        let [theta_i, _, theta_o, _] = angles;
        assert!(
            theta_i.abs() <= self.limits.max_theta_i + ROUNDING,
            "{theta_i}"
        );
        assert!(
            theta_o.abs() <= self.limits.max_theta_o + ROUNDING,
            "{theta_o}"
        );
        let separation = self.simulated.directions().separation();
        if separation < self.closest.0 {
            self.closest = (separation, angles);
        }
        10
    }

    fn receive(&mut self) -> Option<u8> {
        None
    }

    fn send(&mut self, _: u8) -> bool {
        true
    }

    fn command(&mut self) -> Option<Command> {
        None
    }

    fn save_positions(&mut self, positions: Option<[i32; 4]>) {
        self.retained = retained::encode(positions);
    }

    fn report(&mut self, event: Event) {
        if (self.watch)(&event) {
            std::panic::resume_unwind(Box::new(PowerOff));
        }
    }

    fn report_fit(&mut self, _: Residual, _: &mut dyn Iterator<Item = f32>) {}
}

/// Scans once, and asserts in each iteration that lamp and sensor are apart. Returns None after a power cut by `watch`.
fn scan<'w>(
    simulated: &'w SimulatedScanner,
    recipe: &[u8],
    counts: Option<[i32; 4]>,
    watch: impl FnMut(&Event) -> bool + 'w,
) -> (Option<Outcome>, Observer<'w>) {
    let mut flash = Flash::new(6);
    let mut station = simulated.station_with_limits(LIMITS);
    if let Some(counts) = counts {
        station.assume(counts);
    }
    let mut scanner = Scanner {
        station,
        readings: mount_readings(&mut flash),
        recipes: mount_recipes(&mut flash),
        flash,
        seeds: Seeds::new(0),
    };
    let mut observer = Observer {
        simulated,
        limits: LIMITS,
        closest: (PI, [0.0; 4]),
        retained: [0; retained::WORDS],
        watch: Box::new(watch),
    };
    let mut memory = [0.0; MEMORY_WORDS];
    let run = std::panic::AssertUnwindSafe(|| {
        scanner.scan::<Model>(
            recipe,
            &mut memory,
            Host::Absent,
            StartMode::Immediate,
            &mut observer,
        )
    });
    let outcome = match std::panic::catch_unwind(run) {
        Ok(outcome) => Some(outcome),
        Err(payload) if payload.is::<PowerOff>() => None,
        Err(panic) => std::panic::resume_unwind(panic),
    };
    let (separation, at) = observer.closest;
    assert!(
        separation >= LIMITS.min_separation - ROUNDING,
        "{separation} rad apart at {at:?}"
    );
    (outcome, observer)
}

/// From every start at which the lamp is not outside of the sensor at the same azimuth: homing, eight samples, two
/// homings in between, and the last homing.
#[test]
fn no_collision_during_scan() {
    let starts = [
        [300, 500, 40, 700],
        [0, 0, 0, 0],
        [0, 12_000, 2500, 12_000],
        [2500, 9000, 0, 9000],
        [2900, 300, 2900, 6700],
        [500, 4000, 1500, 4000],
    ];
    for start in starts {
        for recipe in [NEURAL, COOK_TORRANCE] {
            let simulated = SimulatedScanner::new(start);
            let (outcome, _) = scan(&simulated, recipe, None, |_| false);
            assert_eq!(outcome, Some(Outcome::Finished));
            assert_eq!(simulated.positions(), [0; 4], "it ends at home");
        }
    }
}

#[test]
fn no_collision_at_home_at_any_azimuth() {
    for azimuth in (0..12_800).step_by(100) {
        let simulated = SimulatedScanner::new([0, 0, 0, azimuth]);
        assert!(separation(simulated.angles()) > 1.4);
    }
}

/// Homing after a reset during a scan. The step counts survive the reset.
#[test]
fn no_collision_when_homing_after_reset() {
    for reads in 1..=8 {
        let simulated = SimulatedScanner::new([300, 500, 40, 700]);
        let mut count = 0;
        let (outcome, observer) = scan(&simulated, NEURAL, None, move |event| {
            count += u32::from(matches!(event, Event::Read { .. }));
            count == reads
        });
        assert_eq!(outcome, None);
        let counts = retained::decode(observer.retained);
        assert!(counts.is_some());
        let (outcome, _) = scan(&simulated, NEURAL, counts, |_| false);
        assert_eq!(outcome, Some(Outcome::Finished));
    }
}

fn space(limits: Limits) -> Space {
    let settings: [Settings; 4] = std::array::from_fn(settings);
    Space {
        min_angles: settings.map(|settings| settings.min_angle),
        max_angles: settings.map(|settings| settings.max_angle),
        home: settings.map(|settings| settings.home),
        near_home: settings.map(|settings| settings.near_home()),
        limits,
        tolerance: 0.0,
    }
}

/// Returns a random number from 0 to 1.
fn random(state: &mut u64) -> f32 {
    *state = state
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1);
    (*state >> 40) as f32 / (1 << 24) as f32
}

fn random_angles(space: &Space, state: &mut u64) -> AxisAngles {
    std::array::from_fn(|axis| {
        let (min, max) = (space.min_angles[axis], space.max_angles[axis]);
        min + random(state) * (max - min)
    })
}

/// There is a route between any two safe configurations, and every combination of angles on its legs is safe.
#[test]
fn route_connects_all_safe_configurations() {
    let mut state = 1;
    let mut legs = [0; 8];
    for min_separation in [0.05, 0.2, 0.5, 1.0] {
        let space = space(Limits {
            min_separation,
            ..Limits::NONE
        });
        space.check_home().unwrap();
        let mut safe = || loop {
            let angles = match random(&mut state) {
                home if home < 0.1 => space.home,
                _ => random_angles(&space, &mut state),
            };
            if separation(angles) > min_separation + 1e-4 {
                return angles;
            }
        };
        for _ in 0..2000 {
            let (start, end) = (safe(), safe());
            let route = space.route(start, end).unwrap();
            let mut from = start;
            for to in route {
                for corner in 0..625 {
                    let digits = [1, 5, 25, 125].map(|digit| (corner / digit % 5) as f32 / 4.0);
                    let angles: AxisAngles = std::array::from_fn(|axis| {
                        from[axis] + digits[axis] * (to[axis] - from[axis])
                    });
                    let separation = separation(angles);
                    assert!(
                        separation >= min_separation - 1e-4,
                        "{separation} at {angles:?}"
                    );
                }
                from = to;
            }
            assert_eq!(from, end);
            legs[route.count()] += 1;
        }
    }
    println!("{legs:?} routes of 0, 1, 2... legs");
    assert!(legs[1] > 1000 && legs[2] > 1000 && legs[3..].iter().sum::<u32>() > 10);
}

/// Compares with a fine grid.
#[test]
fn separation_between_matches_grid_search() {
    let mut state = 7;
    let space = space(Limits::NONE);
    for case in 0..200 {
        let from = random_angles(&space, &mut state);
        let mut to = random_angles(&space, &mut state);
        if case % 2 == 0 {
            // A small box.
            to = std::array::from_fn(|axis| from[axis] + 0.1 * (to[axis] - from[axis]));
        }
        let n = 14;
        let mut min = PI;
        for corner in 0..n * n * n * n {
            let digits =
                [1, n, n * n, n * n * n].map(|digit| (corner / digit % n) as f32 / (n - 1) as f32);
            let angles =
                std::array::from_fn(|axis| from[axis] + digits[axis] * (to[axis] - from[axis]));
            min = min.min(separation(angles));
        }
        let exact = separation_between(from, to);
        assert!(exact <= min + 1e-3, "{exact} {min}");
        // The grid's spacing is at most 0.3 rad in an azimuth.
        let spacing = if case % 2 == 0 { 0.07 } else { 0.6 };
        assert!(min <= exact + spacing, "{exact} {min}: {from:?} {to:?}");
    }
}

#[test]
fn nan_angles_are_unsafe() {
    let bad = [f32::NAN, 0.0, 1.0, 0.0];
    assert_eq!(separation_between(bad, [0.0; 4]), 0.0);
    let space = space(LIMITS);
    assert_eq!(space.route(space.home, bad), Err(RouteError::NoSafeRoute));
}

/// With azimuths that cannot turn, the lamp cannot pass the sensor.
#[test]
fn rejects_target_without_safe_route() {
    let mut space = space(LIMITS);
    space.min_angles[1] = -0.01;
    space.max_angles[1] = 0.01;
    space.min_angles[3] = -0.01;
    space.max_angles[3] = 0.01;
    space.home[1] = -0.02;
    space.home[3] = -0.02;
    let (inside, outside) = ([0.2, 0.0, 1.0, 0.0], [1.0, 0.0, 0.2, 0.0]);
    assert_eq!(space.route(inside, outside), Err(RouteError::NoSafeRoute));
    assert!(space.route(inside, [0.5, 0.0, 1.2, 0.0]).is_ok());
}

#[test]
fn rejects_colliding_home_without_moving() {
    let limits = Limits {
        min_separation: 1.7,
        ..LIMITS
    };
    let start = [300, 500, 40, 700];
    let simulated = SimulatedScanner::new(start);
    let mut station = simulated.station_with_limits(limits);
    let result = station.go_home();
    assert!(matches!(
        result,
        Err(StationError::Route(RouteError::HomeTooClose { .. }))
    ));
    assert_eq!(station.poll(10), Ok(None));
    assert_eq!(simulated.positions(), start);
}

#[test]
fn rejects_home_beyond_limits() {
    let limits = Limits {
        max_theta_o: 1.2,
        ..LIMITS
    };
    let simulated = SimulatedScanner::new([1; 4]);
    let result = simulated.station_with_limits(limits).go_home();
    let error = StationError::Route(RouteError::HomeBeyondLimits);
    assert_eq!(result, Err(error));
    // The home is within the limits of an unrestricted machine.
    assert!(settings(2).home <= FRAC_PI_2);
}
