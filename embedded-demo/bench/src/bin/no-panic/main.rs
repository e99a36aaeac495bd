//! A proof: this binary links only if no public function of `glimpse-core` can reach a panic.
//!
//! The panic handler calls an undefined function. All inputs are hidden from the optimizer, so any check that it
//! removes, such as a bounds check, is unnecessary for every input. (The formatting of errors is not included: it
//! belongs to the standard library. Overflow checks are not included either: release builds have none, and lengths and
//! counts are bounded when a recipe is parsed.)

#![no_std]
#![no_main]

mod internals;

use core::hint::black_box;
use core::panic::PanicInfo;

#[cfg(target_arch = "arm")]
use cortex_m_rt::entry;
#[cfg(target_arch = "riscv32")]
use riscv_rt::entry;

use glimpse_core::checksum::{crc_32, crc_32_of_file};
use glimpse_core::driver::{Config, Driver, Host};
use glimpse_core::error_code::ErrorCode;
use glimpse_core::fit::{AnyModel, Fitter, Linear, Progress};
use glimpse_core::geometry::{Angles, ArmAngles, Directions};
use glimpse_core::gonio::{
    Calibration, Footprint, Limits, Machine, Quantity, Repeated, Speeds, tile,
};
use glimpse_core::link::{
    Client, FRAME_BYTES, Failure, Received, Refusal, Reply, Request, Server, Values,
};
use glimpse_core::model::linear::Basis;
use glimpse_core::model::{CookTorrance, ModelKind, Neural, Phong};
use glimpse_core::recipe::{Field, Kind, Recipe, max_samples, memory_words};
use glimpse_core::scan::{Reading, Residual, Saved, Scan};

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

/// Hides a value from the optimizer.
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

#[inline(never)]
fn names_and_codes() {
    let kind = any(ModelKind::Linear);
    black_box((kind.name(), kind.parameters()));
    let code = ErrorCode::from_code(any(32));
    black_box(code.map(|code| (code.code(), code.text())));
    black_box(Refusal::from(any(99)).code());
    black_box(Failure::Refused(any(Refusal::NoScan)).code());
    black_box((crc_32(bytes()), crc_32_of_file(any(1), any(2), bytes())));
    black_box(any(Angles::<f32>::default()));
}

#[inline(never)]
fn arms_and_machine() {
    let directions = directions();
    black_box((
        directions.check().is_ok(),
        directions.separation(),
        directions.out_of_plane(),
    ));
    black_box(directions.turned(any(1.0)));
    let arms = ArmAngles::from_directions(&directions);
    black_box((arms.directions(), arms.turned(any(1.0))));
    let limits = Limits {
        max_theta_i: any(1.0),
        max_theta_o: any(1.0),
        min_separation: any(0.1),
        in_plane: any(true),
    };
    black_box((limits.validate().is_ok(), limits.check(&directions).is_ok()));
    let calibration = Calibration::new(any([1.0; 3]), any([2.0; 3]), any([0.9; 3]));
    if let Ok(calibration) =
        calibration.and_then(|calibration| calibration.saturating_at(any(4095.0)))
    {
        black_box(calibration.brdf(any([1.5; 3])).map(Reading::from)).ok();
        let once = calibration.read_once_at(&directions, any(Footprint::LightLarger));
        if let Ok(once) = once {
            black_box(once.brdf(any([1.5; 3]), &directions)).ok();
        }
    }
    let mut repeated = Repeated::new();
    black_box(repeated.add(any([0.5; 3]), any(false))).ok();
    black_box((
        repeated.mean(),
        repeated.variance(),
        repeated.count(),
        repeated.saturated(),
    ));
    let quantity = any(Quantity::Brdf);
    black_box((
        quantity.factor(&directions).is_ok(),
        quantity.to_brdf(any([0.5; 3]), &directions).is_ok(),
        quantity.of_brdf(any([0.5; 3]), &directions).is_ok(),
    ));
    let readings = [(directions, any([0.3; 3])); 8];
    let readings = readings.get(..any(8)).unwrap_or_default();
    black_box(tile::examine(readings, any([0.9; 3])));
    let speed = any(0.5);
    let machine = Machine {
        speeds: Speeds {
            theta_i: speed,
            phi_i: speed,
            theta_o: speed,
            phi_o: speed,
        },
        limits,
        isotropic: any(true),
        through_normal: any(false),
    };
    let pending = readings.iter().map(|(directions, _)| (any(1), *directions));
    black_box(machine.nearest(pending, &arms));
    if let Ok(recipe) = Recipe::parse(bytes()) {
        black_box(recipe.out_of_reach(&limits));
    }
}

/// Linear's basis, read in place.
#[inline(never)]
fn basis() {
    let Ok(basis) = Basis::parse(bytes()) else {
        return;
    };
    black_box((basis.components(), basis.checksum(), basis.of()));
    if let Ok(recipe) = Recipe::parse(bytes()) {
        let mut memory = [0.0; 64];
        let scan = Scan::<Linear>::new(recipe, black_box(&mut memory));
        if let Ok(scan) = scan.and_then(|scan| scan.with_basis(basis))
            && let Some(fitted) = scan.fitted()
        {
            black_box(fitted.brdf(&directions()));
        }
    }
}

#[inline(never)]
fn recipe() {
    let Ok(recipe) = Recipe::parse(bytes()) else {
        return;
    };
    black_box((recipe.model(), recipe.samples(), recipe.expected_loss()));
    black_box(recipe.checksum());
    recipe.pattern().for_each(|angles| {
        black_box(angles);
    });
    recipe.directions().for_each(|each| {
        black_box(each);
    });
    recipe.sections().for_each(|(kind, bytes)| {
        black_box((kind.number(), kind.name(), kind.is_required(), bytes));
    });
    let mut buffer = [0; 64];
    let kinds = [Kind::new(any(200)), Kind::MATERIALS];
    let _ = black_box(recipe.copy_without(&kinds, black_box(&mut buffer[..])));
    if let Ok(metadata) = recipe.metadata() {
        black_box((metadata.limits, metadata.noise, metadata.training.is_some()));
        metadata.materials.for_each(|material| {
            black_box(material);
        });
    }
    black_box(any(Field::Basis).range());
    black_box((
        recipe.tolerates_missing(),
        recipe.basis_checksum(),
        recipe.memory_words(),
        recipe.values(),
        memory_words(&[bytes()]),
        max_samples(&[bytes()]),
    ));
}

/// A scan from beginning to end, and its driver.
#[inline(never)]
fn scan<K: Fitter>() {
    let Ok(recipe) = Recipe::parse(bytes()) else {
        return;
    };
    let mut memory = [0.0; 64];
    let memory = black_box(&mut memory)
        .get_mut(..any(64))
        .unwrap_or_default();
    black_box(Scan::<K>::accept(&recipe, any(64)).is_ok());
    let Ok(mut scan) = Scan::<K>::new(recipe, memory) else {
        return;
    };
    scan.restart();
    black_box((scan.recipe(), scan.next_pending(), scan.pending().count()));
    black_box(scan.record(any(1), reading()).is_ok());
    black_box((scan.reading(any(1)), reading().check().is_ok()));
    black_box((scan.skip(any(1)).is_ok(), scan.finish_early().is_ok()));
    black_box(Reading::monochrome(any(0.5)));
    if let Ok(mut fit) = scan.fit() {
        black_box((fit.advance(any(8)), fit.progress()));
    }
    if let Some(fit) = scan.fit_under_way()
        && let Ok(fitted) = fit.finish()
    {
        black_box((fitted.brdf(&directions()), fitted.residual()));
        black_box((fitted.expected_loss(), fitted.predicted_loss()));
        black_box((fitted.loss_bound(), fitted.is_unlike_training()));
        fitted.values().for_each(|value| {
            black_box(value);
        });
    }
    black_box(scan.fitted().is_some());

    let mut config = Config::new(any(Host::Measures));
    config.limits = any(Some(Limits::NONE));
    (config.recipe_bytes, config.sequence_seed) = (any(1), any(7));
    config.target_loss = any(Some(0.1));
    drive(&mut Driver::<K>::without_scan(
        any(Failure::Machine),
        config,
    ));
    if let Ok(scan) = Scan::<K>::new(recipe, scan.into_memory()) {
        drive(&mut Driver::new(scan, config));
    }
}

#[inline(never)]
fn drive<K: Fitter>(driver: &mut Driver<'_, K>) {
    for byte in bytes() {
        driver.receive(*byte);
        black_box((driver.poll(any(1)), driver.poll_delay(any(2))));
        black_box(driver.outgoing());
        driver.sent(any(1));
        driver.record(any(1), reading());
        black_box((driver.skip(any(1)).is_ok(), driver.finish_early().is_ok()));
        driver.decline(any(1));
        black_box(driver.declined());
        if any(false) {
            driver.fail(any(Failure::NoReply));
        }
        if any(false) {
            driver.restart();
        }
    }
    black_box(driver.scan().is_ok());
}

#[inline(never)]
fn saved() {
    let Ok(recipe) = Recipe::parse(bytes()) else {
        return;
    };
    let mut saved = match Saved::<8>::read(bytes(), &recipe) {
        Ok(saved) => saved,
        Err(_) => Saved::new(&recipe),
    };
    black_box(saved.insert(any(1), reading()).is_ok());
    black_box(saved.readings());
    let mut buffer = [0; Saved::<8>::BYTES];
    let length = any(buffer.len());
    let buffer = buffer.get_mut(..length).unwrap_or_default();
    black_box(saved.write(buffer).is_ok());
    saved.clear();
    black_box(saved.readings());
}

#[inline(never)]
fn link() {
    let mut frame = [0; FRAME_BYTES];
    let length = any(frame.len());
    let frame = frame.get_mut(..length).unwrap_or_default();
    let mut client = Client::new(any(1));
    let mut server = Server::new();
    let progress = Progress {
        done: any(1),
        total: any(2),
    };
    let requests = [
        Request::Hello {
            protocol: any(1),
            model: any(ModelKind::Neural),
            samples: any(8),
            recipe: any(0),
        },
        Request::Measure {
            index: any(1),
            directions: directions(),
        },
        Request::Progress(progress),
        Request::Values {
            offset: any(0),
            total: any(0),
            values: Values::try_from(numbers()).unwrap_or_default(),
        },
        Request::Finished(Residual {
            mean: any(0.0),
            worst_index: any(0),
            worst: any(0.0),
            saturated: any(0),
            repeated: any(0),
            clamped: any(0),
            implausible: any(None),
        }),
        Request::Failed(any(Failure::NoReply).into()),
        Request::Saved {
            index: any(1),
            reading: reading(),
        },
    ];
    for request in &requests {
        black_box(client.request(request, frame).is_ok());
        for byte in bytes() {
            black_box(client.receive(*byte, request).is_some());
        }
    }
    for byte in bytes() {
        if let Some(Ok(Received::New(_))) = black_box(server.receive(*byte)) {
            let reply = Reply::Measured {
                index: any(1),
                reading: reading(),
            };
            black_box(server.reply(reply, frame).is_ok());
        }
    }
}

#[entry]
fn main() -> ! {
    names_and_codes();
    arms_and_machine();
    basis();
    recipe();
    scan::<Neural>();
    scan::<Phong>();
    scan::<CookTorrance>();
    scan::<Linear>();
    scan::<AnyModel>();
    saved();
    link();
    internals::elementary_functions();
    internals::recipe();
    internals::completion();
    internals::ridge();
    loop {
        core::hint::spin_loop();
    }
}
