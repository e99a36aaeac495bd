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

use glimpse_core::fit::ridge::{Problem, RidgeGradient, factor_length, scratch_length};
use glimpse_core::fit::{Fit, Progress, Workspace, residuals};
use glimpse_core::geometry::{Angles, Directions, HalfDifference};
use glimpse_core::link::{Answerer, Asker, FRAME_BYTES, Failure, Heard, Reply, Request};
use glimpse_core::model::linear::{map, unmap};
use glimpse_core::model::{CookTorrance, Model, ModelKind, Neural, Phong, Sample};
use glimpse_core::numeric::math;
use glimpse_core::recipe::{Floats, Learner, Recipe};
use glimpse_core::scan::{LinearScan, Measurement, Record, Residual, Scan};
use glimpse_fits::machine::only;

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

fn measurement() -> Measurement {
    Measurement {
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
fn recipe() {
    let Ok(recipe) = Recipe::parse(bytes()) else {
        return;
    };
    black_box((recipe.model(), recipe.samples(), recipe.expected_loss()));
    black_box((recipe.provenance(), recipe.checksum()));
    recipe.pattern().for_each(|angles| {
        black_box(angles);
    });
    match recipe.learner() {
        Learner::Descent(descent) => {
            black_box((descent.model(), descent.inner_steps()));
            black_box((descent.initial(), descent.step_sizes()));
        }
        Learner::Ridge(ridge) => {
            black_box((ridge.problem(), ridge.components(), ridge.basis()));
            black_box((ridge.mean(), ridge.median(), ridge.weight()));
            black_box((ridge.precision(), ridge.basis_checksum()));
        }
    }
    if let Some(mut floats) = Floats::new(bytes()) {
        black_box((floats.take(any(3)), floats.len(), floats.is_empty()));
        floats.iter().for_each(|value| {
            black_box(value);
        });
    }
}

#[inline(never)]
fn descent<M: Model>(workspace: &mut Workspace<M>) {
    if let Some(floats) = Floats::new(bytes()) {
        let mut fit = Fit::start(workspace, floats, floats, any(20));
        let samples = [sample(), sample(), sample()];
        let samples = samples.get(..any(3)).unwrap_or_default();
        black_box(fit.advance(workspace, samples, any(8)));
        residuals::<M>(workspace.parameters(), samples).for_each(|error| {
            black_box(error);
        });
    }
    let Ok(recipe) = Recipe::parse(bytes()) else {
        return;
    };
    let mut begun = Scan::<M, 8>::new(recipe, workspace);
    let Ok(scan) = &mut begun else {
        return;
    };
    scan.restart();
    black_box(scan.next_directions());
    black_box(scan.record(measurement()).is_ok());
    black_box(scan.advance_fit(any(8)).is_complete());
    black_box((scan.brdf(&directions()), scan.residual(), scan.recipe()));
    black_box(scan.parameters());
}

#[inline(never)]
fn ridge() {
    if let Ok(recipe) = Recipe::parse(bytes()) {
        let mut memory = [0.0; LinearScan::<8>::memory_length(8, 5)];
        let length = any(memory.len());
        let memory = memory.get_mut(..length).unwrap_or_default();
        let mut begun = LinearScan::<8>::new(recipe, memory);
        if let Ok(scan) = &mut begun {
            scan.restart();
            black_box(scan.next_directions());
            black_box(scan.record(measurement()).is_ok());
            black_box(scan.advance_fit(any(3)));
            black_box((scan.residual(), scan.recipe()));
            black_box(scan.coefficients());
        }
    }
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
fn record() {
    let Ok(recipe) = Recipe::parse(bytes()) else {
        return;
    };
    let mut record = match Record::<8>::read(bytes(), &recipe) {
        Ok(record) => record,
        Err(_) => Record::new(&recipe),
    };
    black_box(record.push(measurement()).is_ok());
    black_box(record.measurements());
    let mut buffer = [0; Record::<8>::BYTES];
    let length = any(buffer.len());
    let buffer = buffer.get_mut(..length).unwrap_or_default();
    black_box(record.write(buffer).is_ok());
    record.clear();
    black_box(record.measurements());
}

#[inline(never)]
fn link() {
    let mut frame = [0; FRAME_BYTES];
    let length = any(frame.len());
    let frame = frame.get_mut(..length).unwrap_or_default();
    let mut asker = Asker::new();
    let mut answerer = Answerer::new();
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
        Request::Parameters {
            offset: any(0),
            values: numbers().iter().copied().take(any(32)).collect_values(),
        },
        Request::Finished(Residual {
            mean: any(0.0),
            worst_index: any(0),
            worst: any(0.0),
            saturated: any(0),
            repeated: any(0),
        }),
        Request::Failed(any(Failure::NoReply)),
        Request::Kept {
            index: any(1),
            measurement: measurement(),
        },
    ];
    for request in &requests {
        black_box(asker.ask(request, frame).is_ok());
        for byte in bytes() {
            black_box(asker.hear(*byte, request));
        }
    }
    for byte in bytes() {
        if let Some(Ok(Heard::New(_))) = black_box(answerer.hear(*byte)) {
            let reply = Reply::Measured {
                index: any(1),
                measurement: measurement(),
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

static mut NEURAL: Workspace<Neural> = Workspace::new();
static mut PHONG: Workspace<Phong> = Workspace::new();
static mut COOK_TORRANCE: Workspace<CookTorrance> = Workspace::new();

#[entry]
fn main() -> ! {
    geometry_and_elementary_functions();
    recipe();
    // SAFETY: the entry point runs once, and nothing else knows of them.
    unsafe {
        descent(only(&raw mut NEURAL));
        descent(only(&raw mut PHONG));
        descent(only(&raw mut COOK_TORRANCE));
    }
    ridge();
    record();
    link();
    loop {
        core::hint::spin_loop();
    }
}
