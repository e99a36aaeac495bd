//! What training computes, on f32 lanes, against the same in f64.

use std::marker::PhantomData;

use glimpse_core::angles::HalfDifference;
use glimpse_core::model::{CookTorrance, Model, Neural, Phong, Sample, SampleGradient};
use glimpse_trainer::lanes::{
    Kernel, Lanes, Octet, PortableLanes, WIDTH, dispatch, instruction_set,
};
use glimpse_trainer::material::{Material, Procedural};
use glimpse_trainer::meta::gradient::{DrawnGradient, Learner, PatternGradient};
use glimpse_trainer::meta::pattern::{MeasuredPattern, Pattern};
use glimpse_trainer::meta::pool::{Draw, Pool, Variation};
use glimpse_trainer::meta::start::first_guess;
use glimpse_trainer::meta::unroll::{Inner, MetaGradient, Samples, meta_gradient};
use glimpse_trainer::sampling::sobol_valid;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Largest distance of a gradient in f32 from the one in f64, relative to its length.
const TOLERANCE: f64 = 1e-4;

const STEPS: usize = 20;

/// Lanes taken apart into samples in f64; lanes without weight are left out.
pub(crate) fn unpack(samples: &impl Samples<PortableLanes>) -> Vec<Sample<f64>> {
    let mut list = Vec::new();
    for index in 0..samples.batches() {
        let batch = samples.batch(index);
        let [hx, hz, dx, dy, dz] = [
            batch.at.hx,
            batch.at.hz,
            batch.at.dx,
            batch.at.dy,
            batch.at.dz,
        ]
        .map(Lanes::store);
        let measured = batch.measured.map(Lanes::store);
        let weights = batch.weight.store();
        for lane in 0..WIDTH {
            let number = |octet: &Octet| f64::from(octet.0[lane]);
            list.push(Sample {
                at: HalfDifference {
                    hx: number(&hx),
                    hz: number(&hz),
                    dx: number(&dx),
                    dy: number(&dy),
                    dz: number(&dz),
                },
                measured: measured.each_ref().map(number),
                weight: number(&weights),
            });
        }
    }
    list.retain(|sample| sample.weight != 0.0);
    list
}

fn double(list: &[f32]) -> Vec<f64> {
    list.iter().copied().map(f64::from).collect()
}

/// The meta-gradient in f64; `inner` are the samples of each step.
fn exact<M: Model>(
    learner: Learner<'_>,
    inner: &[Vec<Sample<f64>>],
    outer: &[Sample<f64>],
) -> MetaGradient<f64, f64> {
    let inner: Vec<&[Sample<f64>]> = inner.iter().map(Vec::as_slice).collect();
    let inner = Inner {
        samples: &inner,
        steps: learner.steps,
    };
    let (initial, step_sizes) = (double(learner.initial), double(learner.step_sizes));
    meta_gradient::<M, f64, _, _, true>(&initial, &step_sizes, &inner, outer)
}

/// The distance of `found` from `exact`, relative to the length of `exact`.
fn distance(found: &[f64], exact: &[f64]) -> f64 {
    assert_eq!(found.len(), exact.len());
    let norm = |list: &mut dyn Iterator<Item = f64>| list.map(|x| x * x).sum::<f64>().sqrt();
    let difference = norm(&mut found.iter().zip(exact).map(|(a, b)| a - b));
    let length = norm(&mut exact.iter().copied());
    assert!(length > 0.0, "the gradient vanishes");
    difference / length
}

/// A gradient by samples, flat: half and difference vector and measured values of each.
fn flat<T: Copy>(by: &SampleGradient<T>) -> [T; 8] {
    let [red, green, blue] = by.measured;
    [
        by.at.hx, by.at.hz, by.at.dx, by.at.dy, by.at.dz, red, green, blue,
    ]
}

/// Materials, their pool, and a learner: what one task is made of.
struct Setting {
    materials: Vec<Box<dyn Material>>,
    pool: Pool,
    initial: Vec<f32>,
    step_sizes: Vec<f32>,
    random: ChaCha8Rng,
}

impl Setting {
    fn new<M: Model>(seed: u64) -> Self {
        let materials: Vec<Box<dyn Material>> = Procedural::set(4, seed)
            .into_iter()
            .map(|material| Box::new(material) as Box<dyn Material>)
            .collect();
        let pool = Pool::new(&materials, 1024, seed);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        Self {
            materials,
            pool,
            initial: first_guess(M::KIND, &mut random),
            step_sizes: (0..M::PARAMETERS)
                .map(|_| random.random_range(-7.0..-3.0f32).exp())
                .collect(),
            random,
        }
    }

    fn learner(&self) -> Learner<'_> {
        Learner {
            initial: &self.initial,
            step_sizes: &self.step_sizes,
            steps: STEPS,
        }
    }
}

/// Largest distances found: loss, initial parameters, step sizes, samples.
#[derive(Default)]
struct Distances([f64; 4]);

impl Distances {
    fn add(&mut self, found: &MetaGradient<f32, Octet>, exact: &MetaGradient<f64, f64>) {
        let mut distances = [
            (f64::from(found.loss) - exact.loss).abs() / exact.loss,
            distance(&double(&found.initial), &exact.initial),
            distance(&double(&found.step_sizes), &exact.step_sizes),
            0.0,
        ];
        if !found.samples.is_empty() {
            let by_sample = |sample: usize| {
                let octets = flat(&found.samples[sample / WIDTH]);
                octets.map(|octet| f64::from(octet.0[sample % WIDTH]))
            };
            let all: Vec<f64> = (0..exact.samples.len()).flat_map(by_sample).collect();
            let expected: Vec<f64> = exact.samples.iter().flat_map(flat).collect();
            distances[3] = distance(&all, &expected);
        }
        for (largest, distance) in self.0.iter_mut().zip(distances) {
            // Written so that a NaN fails as well.
            assert!(distance <= TOLERANCE, "distances {distances:?}");
            *largest = largest.max(distance);
        }
    }

    fn report(&self, what: &str) {
        let [loss, initial, step_sizes, samples] = self.0;
        println!(
            "{what}: loss {loss:.1e}, initial parameters {initial:.1e}, step sizes \
             {step_sizes:.1e}, samples {samples:.1e}"
        );
    }
}

fn compare_patterns<M: Model>() {
    let [mut best, mut portable] = [Distances::default(), Distances::default()];
    for seed in 0..10 {
        let mut setting = Setting::new::<M>(seed);
        // Whole octets and others, and one sample below the horizon, which has no weight.
        let mut places = sobol_valid([8, 13, 1, 24][seed as usize % 4], seed as u32);
        if places.len() == 24 {
            places[23].theta_h = 1.5;
            places[23].theta_d = 1.5;
        }
        let pattern = Pattern::new(places);
        let variation = Variation::random(2.0, &mut setting.random);
        let inner = pattern.measure(&*setting.materials[1], variation);
        let outer = setting.pool.draw(1, variation, 250, &mut setting.random);
        let kernel = |learner| PatternGradient::<M> {
            learner,
            inner: &inner,
            outer: &outer,
            model: PhantomData,
        };
        let learner = setting.learner();
        let samples = unpack(&inner as &MeasuredPattern);
        let exact = exact::<M>(learner, &[samples], &unpack(&outer));
        best.add(&dispatch(kernel(learner)), &exact);
        portable.add(&kernel(learner).run::<PortableLanes>(), &exact);
    }
    let name = M::KIND.name();
    best.report(&format!("{name}, pattern, {}", instruction_set()));
    portable.report(&format!("{name}, pattern, portable"));
}

fn compare_draws<M: Model>() {
    let [mut best, mut portable] = [Distances::default(), Distances::default()];
    for seed in 0..10 {
        let mut setting = Setting::new::<M>(seed);
        // Fresh samples at each step, or a single list for all of them.
        let lists = [STEPS, 1][seed as usize % 2];
        let outer = setting
            .pool
            .draw(2, Variation::NONE, 250, &mut setting.random);
        let draws: Vec<Draw<'_>> = (0..lists)
            .map(|_| {
                setting
                    .pool
                    .draw(2, Variation::NONE, 30, &mut setting.random)
            })
            .collect();
        let inner: Vec<&Draw<'_>> = draws.iter().collect();
        let kernel = |learner| DrawnGradient::<M> {
            learner,
            inner: &inner,
            outer: &outer,
            model: PhantomData,
        };
        let learner = setting.learner();
        let samples: Vec<_> = draws.iter().map(unpack).collect();
        let exact = exact::<M>(learner, &samples, &unpack(&outer));
        best.add(&dispatch(kernel(learner)), &exact);
        portable.add(&kernel(learner).run::<PortableLanes>(), &exact);
    }
    let name = M::KIND.name();
    best.report(&format!("{name}, draws, {}", instruction_set()));
    portable.report(&format!("{name}, draws, portable"));
}

#[test]
fn phong_on_a_pattern_agrees_with_double_precision() {
    compare_patterns::<Phong>();
}

#[test]
fn cook_torrance_on_a_pattern_agrees_with_double_precision() {
    compare_patterns::<CookTorrance>();
}

#[test]
fn neural_on_a_pattern_agrees_with_double_precision() {
    compare_patterns::<Neural>();
}

#[test]
fn phong_on_draws_agrees_with_double_precision() {
    compare_draws::<Phong>();
}

#[test]
fn cook_torrance_on_draws_agrees_with_double_precision() {
    compare_draws::<CookTorrance>();
}

#[test]
fn neural_on_draws_agrees_with_double_precision() {
    compare_draws::<Neural>();
}
