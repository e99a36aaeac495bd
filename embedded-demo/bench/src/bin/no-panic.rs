//! A proof: this binary links only if no function that it calls can reach a panic.
//!
//! It calls the public functions of `glimpse-core` that neither the C library nor the demo firmware calls. Those two are
//! linked with the same panic handler: see `capi_firmware` in `tests/firmware.sh`, and `prove-no-panic` in `embedded-demo/Cargo.toml`.
//!
//! The panic handler calls an undefined function. All inputs are hidden from the optimizer, so any check that it
//! removes, such as a bounds check, is unnecessary for every input. (The formatting of errors is not included: it
//! belongs to the standard library. Overflow checks are not included either: release builds have none, and lengths and
//! counts are bounded when a recipe is parsed.)

#![no_std]
#![no_main]

use core::hint::black_box;
use core::panic::PanicInfo;

use glimpse_bench::machine::entry;
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::fit::{Linear, ScanModel};
use glimpse_core::geometry::{Arms, Directions};
use glimpse_core::gonio::{Limits, Machine, Quantity, Reading, tile};
use glimpse_core::link::{DeviceEnd, FRAME_BYTES, HostEnd, Received, Reply, Request, Values};
use glimpse_core::model::linear::Basis;
use glimpse_core::model::{CookTorrance, ModelKind, Neural, Phong};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;

unsafe extern "C" {
    /// Undefined.
    safe fn panic_is_reachable() -> !;
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    panic_is_reachable()
}

/// Bytes and numbers that are hidden from the optimizer.
static BYTES: [u8; 64] = [0; 64];
static NUMBERS: [f32; 32] = [0.0; 32];

/// Hides a value from the optimizer. An enum may then have any variant.
fn any<T: Copy>(value: T) -> T {
    black_box(value)
}

fn bytes() -> &'static [u8] {
    let length = any(64_usize);
    black_box(&BYTES[..]).get(..length).unwrap_or_default()
}

fn numbers() -> &'static [f32] {
    let length = any(32_usize);
    black_box(&NUMBERS[..]).get(..length).unwrap_or_default()
}

fn reading() -> Reading {
    Reading {
        brdf: any([0.5; 3]),
        saturated: any(false),
    }
}

fn directions() -> Directions<f32> {
    Directions {
        incoming: any([0.0, 0.0, 1.0]),
        outgoing: any([0.0, 0.0, 1.0]),
    }
}

/// A scan whose model is a type. The C library takes the model from the recipe.
#[inline(never)]
fn scan<K: ScanModel>() {
    let (Ok(recipe), Ok(basis)) = (Recipe::parse(bytes()), Basis::parse(bytes())) else {
        return;
    };
    let mut memory = [0.0; 64];
    let memory = black_box(&mut memory)
        .get_mut(..any(64))
        .unwrap_or_default();
    black_box(Scan::<K>::accept(&recipe, any(64)).is_ok());
    let scan = Scan::<K>::new(recipe, memory);
    let Ok(mut scan) = scan.and_then(|scan| scan.with_basis(basis)) else {
        return;
    };
    scan.restart();
    black_box((scan.next_pending(), scan.pending().count()));
    black_box(scan.record(any(1), reading()).is_ok());
    black_box((scan.reading(any(1)), scan.skip(any(1)).is_ok()));
    black_box(scan.finish_early().is_ok());
    if let Ok(mut fit) = scan.fit() {
        black_box((fit.advance(any(8)), fit.progress()));
    }
    if let Some(fit) = scan.fit_under_way()
        && let Ok(fitted) = fit.finish()
    {
        black_box((fitted.brdf(&directions()), fitted.residual()));
        black_box(fitted.predicted_loss());
        black_box((fitted.loss_bound(), fitted.is_unlike_training()));
        fitted.values().for_each(|value| {
            black_box(value);
        });
    }
    black_box(scan.into_memory());
}

#[inline(never)]
fn recipe() {
    let Ok(recipe) = Recipe::parse(bytes()) else {
        return;
    };
    recipe.directions().for_each(|each| {
        black_box(each);
    });
    black_box((recipe.metadata(), recipe.expected_loss()));
    black_box(recipe.is_in_path_order());
    black_box((recipe.tolerates_missing(), recipe.bounds_partial_loss()));
    black_box(recipe.basis_checksum());
    let code = ErrorCode::from_number(any(32));
    let error = Error::with(code, any([7, 8]));
    black_box((code.number(), code.text(), error.is_implausible()));
    black_box(any(ModelKind::Linear).name());
}

#[inline(never)]
fn arms() {
    let directions = directions();
    black_box((directions.separation(), directions.out_of_plane()));
    let _ = black_box(Machine::new(any(Limits::NONE)).check(&directions));
    let arms = Arms::from_directions(&directions);
    black_box(arms.directions());
    black_box(any(Limits::NONE).validate().is_ok());
}

#[inline(never)]
fn sensor() {
    let directions = directions();
    let quantity = any(Quantity::Brdf);
    black_box(quantity.to_brdf(any([0.5; 3]), &directions)).ok();
    black_box(quantity.of_brdf(any([0.5; 3]), &directions)).ok();
    let readings = [(directions, any([0.3; 3])); 8];
    let readings = readings.get(..any(8)).unwrap_or_default();
    let _ = black_box(tile::examine(readings, any([0.9; 3])));
}

/// The host's end of the link, and the device's without a driver.
#[inline(never)]
fn link() {
    let mut frame = [0; FRAME_BYTES];
    let length = any(frame.len());
    let frame = frame.get_mut(..length).unwrap_or_default();
    let mut device = DeviceEnd::new(any(1));
    let mut host = HostEnd::default();
    let request = black_box(Request::Values {
        offset: any(0),
        total: any(0),
        values: Values::from_slice(numbers()).unwrap_or_default(),
    });
    black_box(device.request(&request, frame).is_ok());
    for byte in bytes() {
        black_box(device.receive(*byte, &request).is_some());
        if let Some(Ok(Received::New(_))) = black_box(host.receive(*byte)) {
            let reply = black_box(Reply::Measured {
                index: any(1),
                reading: reading(),
            });
            black_box(host.reply(reply, frame).is_ok());
        }
    }
}

#[entry]
fn main() -> ! {
    scan::<Neural>();
    scan::<Phong>();
    scan::<CookTorrance>();
    scan::<Linear>();
    recipe();
    arms();
    sensor();
    link();
    loop {
        core::hint::spin_loop();
    }
}
