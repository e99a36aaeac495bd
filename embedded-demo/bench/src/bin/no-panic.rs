//! A proof: this links only if no public function of `glimpse-core` can reach a panic.
//!
//! The panic handler calls a function that is nowhere. All inputs are hidden from the optimizer,
//! so whatever it leaves out, bounds checks above all, it has proven needless for any input.
//! (Formatting of errors is not part of it: that is the standard library's. Nor are overflow
//! checks, which release builds do not have; lengths and counts are bounded when a recipe is
//! parsed.)

#![no_std]
#![no_main]

use core::hint::black_box;
use core::panic::PanicInfo;

#[cfg(target_arch = "arm")]
use cortex_m_rt::entry;
#[cfg(target_arch = "riscv32")]
use riscv_rt::entry;

use glimpse_bench::Linear;
use glimpse_core::driver::{Config, Driver, Host};
use glimpse_core::fit::coefficient_net::{
    CoefficientNet, CoefficientNetGradient, InitNet, InitNetGradient, Input, Plain, standardized,
};
use glimpse_core::fit::ridge::{Problem, RidgeGradient, factor_length, scratch_length};
use glimpse_core::fit::{AnyModel, Fitter, Progress, Target, linear_words};
use glimpse_core::geometry::{Angles, ArmAngles, Directions, HalfDifference};
use glimpse_core::gonio::{
    Calibration, Footprint, Limits, Machine, Quantity, Repeated, Speeds, tile,
};
use glimpse_core::link::{Client, FRAME_BYTES, Failure, Received, Reply, Request, Server};
use glimpse_core::model::linear::Basis;
use glimpse_core::model::linear::{map, unmap};
use glimpse_core::model::{CookTorrance, ModelKind, Neural, Phong, Sample};
use glimpse_core::numeric::math;
use glimpse_core::recipe::{Field, FitMethod, Floats, Kind, Recipe, RecipeParts};
use glimpse_core::scan::{Memory, Reading, Residual, Saved, Scan};

unsafe extern "C" {
    /// Is nowhere.
    safe fn a_panic_is_reachable() -> !;
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    a_panic_is_reachable()
}

/// Bytes, numbers and sizes that nothing is known of.
static BYTES: [u8; 64] = [0; 64];
static NUMBERS: [f32; 32] = [0.0; 32];

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

fn sample() -> Sample<f32> {
    let angles = Angles {
        theta_h: any(0.1),
        theta_d: any(0.2),
        phi_d: any(0.3),
    };
    Sample {
        at: HalfDifference::from_angles(angles),
        measured: any([0.5; 3]),
        weight: any(0.1),
    }
}

#[inline(never)]
fn geometry_and_elementary_functions() {
    let at = sample().at;
    black_box((
        at.cos_theta_i(),
        at.cos_theta_o(),
        at.is_valid(),
        at.directions(),
    ));
    black_box(HalfDifference::from_directions(&directions()));
    let x = any(1.0);
    black_box((math::exp(x), math::ln(x), math::sqrt(x), math::sin_cos(x)));
    black_box((map(x, x, x), unmap(x, x, x)));
    let kind = any(ModelKind::Linear);
    black_box((kind.name(), kind.parameters()));
}

#[inline(never)]
fn arms_and_machine() {
    let directions = directions();
    black_box((
        directions.check().is_ok(),
        directions.separation(),
        directions.out_of_plane(),
    ));
    black_box((directions.turned(any(1.0)), math::atan2(any(1.0), any(2.0))));
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
    black_box((
        basis.components(),
        basis.checksum(),
        basis.of(),
        basis.nodes(),
    ));
    black_box(basis.brdf([numbers(), numbers(), numbers()], &sample().at));
    if let Ok(recipe) = Recipe::parse(bytes()) {
        let memory = &mut Memory::<Linear, 8>::new();
        if let Ok(scan) = Scan::new(recipe, memory).and_then(|scan| scan.with_basis(basis))
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
    let mut parts = RecipeParts::new(bytes(), recipe.method().into());
    if let Ok(statements) = recipe.metadata() {
        parts.limits = statements.limits;
        parts.noise = statements.noise;
        parts.expectation = statements.expectation;
        parts.provenance = statements.provenance;
        parts.training = statements.training;
        statements.materials.for_each(|material| {
            black_box(material);
        });
    }
    let _ = black_box(Recipe::write(&parts, black_box(&mut buffer[..])));
    black_box(any(Field::Basis).range());
    match recipe.method() {
        FitMethod::Descent(descent) => {
            black_box((descent.model(), descent.inner_steps()));
            black_box((descent.initial(), descent.step_sizes()));
        }
        FitMethod::Ridge(ridge) => {
            black_box((ridge.problem(), ridge.components(), ridge.basis()));
            black_box((ridge.mean(), ridge.median(), ridge.weight()));
            black_box((ridge.precision(), ridge.basis_checksum()));
        }
        FitMethod::Completed(completed) => {
            black_box((completed.model(), completed.takes_missing()));
            black_box((completed.centre(), completed.scale()));
            let completion = completed.coefficient_net();
            black_box((completion.rows(), completion.hidden(), completion.words()));
            match completed.target() {
                Target::Linear(components) => {
                    black_box((components.rows(), components.scales()));
                    black_box(components.basis_checksum());
                }
                Target::Descent(descent, start) => {
                    black_box((descent.initial(), start.units()));
                }
            }
        }
    }
    black_box(recipe.completed().is_some());
    if let Some(mut floats) = Floats::new(bytes()) {
        black_box((floats.take(any(3)), floats.len(), floats.is_empty()));
        floats.iter().for_each(|value| {
            black_box(value);
        });
    }
}

/// A scan from beginning to end, and the driver that leads one.
#[inline(never)]
fn scan<K: Fitter>(memory: &mut Memory<K, 8>) {
    let Ok(recipe) = Recipe::parse(bytes()) else {
        return;
    };
    let Ok(mut scan) = Scan::new(recipe, memory) else {
        return;
    };
    scan.restart();
    black_box((scan.recipe(), scan.next_pending(), scan.pending().count()));
    black_box(scan.record(any(1), reading()).is_ok());
    black_box((scan.reading(any(1)), reading().check().is_ok()));
    black_box(Reading::monochrome(any(0.5)));
    if let Ok(mut fit) = scan.fit() {
        black_box((fit.advance(any(8)), fit.progress()));
    }
    if let Some(fit) = scan.fit_under_way()
        && let Ok(fitted) = fit.finish()
    {
        black_box((fitted.brdf(&directions()), fitted.residual()));
        black_box(fitted.expected_loss());
        fitted.values().for_each(|value| {
            black_box(value);
        });
    }
    black_box(scan.fitted().is_some());

    let Ok(scan) = Scan::new(recipe, scan.into_memory()) else {
        return;
    };
    let mut config = Config::new(any(Host::Measures));
    (config.recipe_bytes, config.slice) = (any(1), any(8));
    drive(&mut Driver::new(any(Ok(())).map(|()| scan), config));
}

#[inline(never)]
fn drive<K: Fitter>(driver: &mut Driver<'_, K>) {
    for byte in bytes() {
        driver.receive(*byte);
        black_box(driver.poll(any(1)));
        black_box(driver.outgoing());
        driver.sent(any(1));
        driver.record(any(1), reading());
        if any(false) {
            driver.fail(any(Failure::NoReply));
        }
        if any(false) {
            driver.restart();
        }
    }
    black_box(driver.scan().is_ok());
}

/// A completion and a start of lists of any length, with their adjoints.
#[inline(never)]
fn completion() {
    let completion = CoefficientNet::<f32, Plain> {
        components: any(5),
        readings: numbers(),
        scales: numbers(),
        bias: numbers(),
        output: numbers(),
        output_scales: numbers(),
    };
    let channels = any([0.5; 3]).map(|brdf| standardized(brdf, any(0.5), any(4.0), any(0.5)));
    let inputs = any([Input {
        channels,
        missing: any(0.0),
    }; 4]);
    let inputs = inputs.get(..any(4)).unwrap_or_default();
    let mut buffers = [[0.0; 32]; 7];
    let lists = black_box(&mut buffers).each_mut();
    let [state, by_state, a, b, c, by_units, units] =
        lists.map(|list| list.get_mut(..any(32)).unwrap_or_default());
    completion.compute(inputs, state);
    let mut by_inputs = [[0.0; 3]; 4];
    let by_inputs = black_box(&mut by_inputs).get_mut(..any(4));
    let mut gradient = CoefficientNetGradient {
        readings: &mut *a,
        bias: &mut *b,
        output: &mut *c,
    };
    let by_inputs = by_inputs.unwrap_or_default();
    completion.adjoint(inputs, state, by_state, &mut gradient, by_inputs);
    let start = InitNet::<f32, Plain> {
        hidden: numbers(),
        hidden_scales: numbers(),
        bias: numbers(),
        output: numbers(),
        output_scales: numbers(),
    };
    let coefficients = completion.coefficients(state);
    start.activate(coefficients, units);
    black_box(start.offset(any(3), units));
    start.offsets(any(3), units, by_state);
    let mut gradient = InitNetGradient {
        hidden: a,
        bias: b,
        output: c,
    };
    let mut by_coefficients = [[0.0; 32]; 3];
    let by_coefficients = black_box(&mut by_coefficients).each_mut();
    let by_coefficients = by_coefficients.map(|list| list.get_mut(..any(32)).unwrap_or_default());
    start.adjoint(
        coefficients,
        units,
        numbers(),
        by_units,
        &mut gradient,
        by_coefficients,
    );
    black_box(&buffers);
}

#[inline(never)]
fn ridge() {
    black_box(linear_words(any(8), any(5)));
    let Ok(problem) = Problem::new(numbers(), numbers()) else {
        return;
    };
    let (samples, components) = (any(problem.samples()), any(problem.components()));
    black_box((
        factor_length(any(8), any(5)),
        scratch_length(any(8), any(5)),
        problem.order(),
    ));
    let mut buffers = [[0.0; 32]; 6];
    let [a, b, c, d, e, f] = black_box(&mut buffers);
    let [a, b, c, d, e, f] =
        [a, b, c, d, e, f].map(|list| list.get_mut(..any(32)).unwrap_or_default());
    black_box((samples, components));
    if let Ok(factors) = problem.factorize::<f32>(a, b) {
        black_box(factors.coefficients(numbers(), c, b).is_ok());
        black_box(factors.solve(numbers(), c, b).is_ok());
        let mut gradient = RidgeGradient {
            basis: d,
            mapped: e,
            precision: f,
        };
        black_box(
            factors
                .adjoint(numbers(), numbers(), numbers(), &mut gradient, b)
                .is_ok(),
        );
    }
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
    let mut asker = Client::new();
    let mut answerer = Server::new();
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
            values: numbers().iter().copied().take(any(32)).collect_values(),
        },
        Request::Finished(Residual {
            mean: any(0.0),
            worst_index: any(0),
            worst: any(0.0),
            saturated: any(0),
            repeated: any(0),
            clamped: any(0),
        }),
        Request::Failed(any(Failure::NoReply)),
        Request::Saved {
            index: any(1),
            reading: reading(),
        },
    ];
    for request in &requests {
        black_box(asker.ask(request, frame).is_ok());
        for byte in bytes() {
            black_box(asker.receive(*byte, request).is_some());
        }
    }
    for byte in bytes() {
        if let Some(Ok(Received::New(_))) = black_box(answerer.receive(*byte)) {
            let reply = Reply::Measured {
                index: any(1),
                reading: reading(),
            };
            black_box(answerer.answer(reply, frame).is_ok());
        }
    }
}

/// heapless' own `collect` panics where there is no room.
trait CollectValues {
    fn collect_values<const N: usize>(self) -> heapless::Vec<f32, N>;
}

impl<I: Iterator<Item = f32>> CollectValues for I {
    fn collect_values<const N: usize>(self) -> heapless::Vec<f32, N> {
        let mut values = heapless::Vec::new();
        for value in self {
            if values.push(value).is_err() {
                break;
            }
        }
        values
    }
}

#[entry]
fn main() -> ! {
    geometry_and_elementary_functions();
    arms_and_machine();
    basis();
    recipe();
    // It is linked and never run: what lies on the stack need not fit.
    scan(&mut Memory::<Neural, 8>::new());
    scan(&mut Memory::<Phong, 8>::new());
    scan(&mut Memory::<CookTorrance, 8>::new());
    scan(&mut Memory::<Linear, 8>::new());
    scan(&mut Memory::<AnyModel<{ linear_words(8, 5) }>, 8>::new());
    completion();
    ridge();
    saved();
    link();
    loop {
        core::hint::spin_loop();
    }
}
