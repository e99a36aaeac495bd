//! A scanner of one's own, which moves its arms itself and survives a power cut, in virtual time:
//! `cargo run -p glimpse-core --example scanner`

mod common;

use common::{angles, material};
use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::geometry::Directions;
use glimpse_core::link::Failure;
use glimpse_core::model::Neural;
use glimpse_core::recipe::{Recipe, max_samples, memory_words};
use glimpse_core::scan::{Reading, Residual, Saved, Scan};

const RECIPE: &[u8] = include_bytes!("recipes/neural-n8.recipe");
/// Number of readings.
const CAPACITY: usize = max_samples(&[RECIPE]);
/// Motors turn so many degrees in a second.
const DEGREES_PER_SECOND: f32 = 20.0;

/// What is there whether power is on or off.
pub(crate) struct Scanner {
    /// Memory that a power cut leaves as it is. (In real flash a write can be cut short: keep two
    /// copies, or a log.)
    flash: [u8; Saved::<CAPACITY>::BYTES],
    /// theta_i, theta_o and phi, in degrees.
    arms: [f32; 3],
    /// Milliseconds of all moves.
    pub(crate) clock: u32,
    /// Readings taken.
    pub(crate) readings: u32,
}

impl Scanner {
    /// Nothing was ever saved.
    pub(crate) fn new() -> Self {
        Self {
            flash: [0; Saved::<CAPACITY>::BYTES],
            arms: [0.0; 3],
            clock: 0,
            readings: 0,
        }
    }

    /// Moves the arms and reads the sensor; returns how many milliseconds that took.
    fn measure(&mut self, directions: &Directions<f32>) -> (Reading, u32) {
        let target = angles(directions);
        let turns = self.arms.iter().zip(&target).map(|(a, b)| (a - b).abs());
        let milliseconds = (1_000.0 * turns.fold(0.0, f32::max) / DEGREES_PER_SECOND) as u32;
        self.arms = target;
        self.clock += milliseconds;
        self.readings += 1;
        (Reading::new(material(directions)), milliseconds)
    }

    /// The firmware, from power on until the scan is done; or, after so many readings, power off.
    pub(crate) fn run(&mut self, power_off_after: u32) -> Result<Option<Residual>, Failure> {
        let mut memory = [0.0; memory_words(&[RECIPE])];
        let recipe = Recipe::parse(RECIPE).map_err(Failure::Recipe)?;
        let mut scan = Scan::<Neural>::new(recipe, &mut memory).map_err(Failure::Scan)?;

        // What was read before a power cut is not read again.
        let saved = Saved::<CAPACITY>::read(&self.flash, &recipe);
        let mut saved = saved.unwrap_or_else(|_| Saved::new(&recipe));
        for (index, reading) in saved.readings() {
            let _ = scan.record(*index, *reading);
        }
        println!("power on, {} readings are there", saved.readings().len());

        let mut driver = Driver::new(scan, Config::new(Host::Absent));
        let mut now_ms = 0; // since power on
        loop {
            match driver.poll(now_ms) {
                Action::Measure { index, directions } => {
                    let (reading, milliseconds) = self.measure(&directions);
                    now_ms += u64::from(milliseconds);
                    driver.record(index, reading);
                    let [theta_i, theta_o, phi] = self.arms;
                    print!("{:6} ms  sample {index}", self.clock);
                    println!("  at {theta_i:5.1} {theta_o:5.1} {phi:6.1} degrees");
                }
                Action::Save { index, reading } => {
                    let _ = saved.insert(index, reading);
                    let _ = saved.write(&mut self.flash);
                    if saved.readings().len() as u32 == power_off_after {
                        println!("power off");
                        return Ok(None);
                    }
                }
                Action::Forget => {
                    saved.clear();
                    let _ = saved.write(&mut self.flash);
                }
                Action::Finished(residual) => return Ok(Some(residual)),
                Action::Failed(failure) => return Err(failure),
                // A firmware sleeps here.
                Action::Wait => now_ms += u64::from(driver.poll_delay(now_ms).unwrap_or(1)),
                _ => {} // without a host no recipe arrives
            }
        }
    }
}

pub(crate) fn main() -> Result<(), Failure> {
    let mut scanner = Scanner::new();
    scanner.run(5)?;
    if let Some(residual) = scanner.run(u32::MAX)? {
        println!("{} readings, {residual:.4?}", scanner.readings);
    }
    Ok(())
}
