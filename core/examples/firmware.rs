//! The main loop of a firmware that moves the arms itself: `cargo run -p glimpse-core --example firmware`

pub(crate) mod common;
use common::Board; // motors, sensor and clock
use glimpse_core::driver::{Action, Config, Driver, Host};
use glimpse_core::error::Error;
use glimpse_core::model::Neural;
use glimpse_core::recipe::{Recipe, memory_words};
use glimpse_core::scan::{Residual, Scan};

static RECIPE: &[u8] = include_bytes!("recipes/neural-n8.recipe");

pub(crate) fn run(board: &mut Board) -> Result<Residual, Error> {
    let mut memory = [0.0; memory_words(&[RECIPE])]; // a static in real firmware
    let scan = Scan::<Neural>::new(Recipe::parse(RECIPE)?, &mut memory)?;
    let mut driver = Driver::new(scan, Config::new(Host::Absent));
    loop {
        match driver.poll(board.now_ms) {
            Action::Measure { index, directions } => {
                // The driver requests a sample with an invalid reading again.
                let _ = driver.record(index, board.read(&directions));
            }
            Action::Finished(residual) => return Ok(residual),
            Action::Failed(error) => return Err(error),
            _ => board.sleep(driver.poll_delay(board.now_ms)),
        }
    }
}

pub(crate) fn main() {
    println!("{:?}", run(&mut Board::default()));
}
