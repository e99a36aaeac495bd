//! The objective of schedule paper for Linear: its gradient, its folds, and patterns without valid samples.

use glimpse_core::geometry::Angles;
use glimpse_fitting::linear::ComponentsAt;
use glimpse_fitting::recipe::options::TrainingOptions;
use glimpse_materials::sampling::uniform_valid;
use glimpse_training::linear::{Columns, principal_components};
use glimpse_training::outer::{MetaValues, OuterStep};
use glimpse_training::paper::objective::{InnerSamples, LossSamples, PaperObjective};
use glimpse_training::paper::ridge::RidgeObjective;
use glimpse_training::pattern::Reach;
use glimpse_training::streams::RandomStreams;

use crate::support::{
    assert_gradient_matches_loss, assert_independent_of_threads, bits, procedural,
};

const MATERIALS: usize = 6;
const BASES: usize = TrainingOptions::PAPER_BASES;
const ETA: f32 = TrainingOptions::PAPER_ETA;
const SEED: u64 = 3;
const STEP: OuterStep = OuterStep {
    phase_index: 1,
    step: 0,
    batch: 8,
};
const SAMPLES: LossSamples = LossSamples {
    inner: InnerSamples::Pattern,
    outer: 4_096,
};

fn objective() -> RidgeObjective {
    let materials = procedural(MATERIALS, 3);
    let columns = Columns::new(&materials);
    RidgeObjective::new(materials, &columns, BASES, ETA, SEED)
}

/// Returns a pattern near the normal, where all samples are valid.
fn values(samples: usize) -> MetaValues {
    let mut pattern = RandomStreams { seed: SEED }.initial_pattern(0, samples);
    for logits in pattern.chunks_mut(3) {
        logits[0] -= 1.0;
        logits[1] -= 1.0;
    }
    MetaValues {
        pattern,
        ..MetaValues::default()
    }
}

#[test]
fn gradient_matches_loss() {
    let objective = objective();
    // Fewer samples than components, and more.
    for samples in [3, 8] {
        let gradient = |values: &MetaValues| objective.gradient(values, STEP, SAMPLES);
        let groups = assert_gradient_matches_loss("linear", &values(samples), gradient);
        assert_eq!(groups, 1);
    }
}

#[test]
fn gradient_is_independent_of_threads() {
    let objective = objective();
    assert_independent_of_threads("linear", || {
        bits(&objective.gradient(&values(8), STEP, SAMPLES).1)
    });
}

/// The expected loss is that of ridge fits, each with a basis of the other folds.
#[test]
fn expected_loss_is_that_of_folds() {
    const FOLDS: usize = 5;
    let values = values(8);
    let estimate = objective().expected_loss(&values);
    let materials = procedural(MATERIALS, 3);
    let columns = Columns::new(&materials);
    let directions = uniform_valid(8_192, SEED);
    let losses = materials.iter().enumerate().map(|(index, material)| {
        let others = columns.columns_of(|other| other % FOLDS != index % FOLDS);
        let basis = principal_components(&columns, &others, BASES);
        let pattern = ComponentsAt::new(&basis, Reach::ANY.reachable_angles(&values.pattern));
        let read = |angles: &Angles<f32>| material.at_angles(*angles);
        let readings: Vec<_> = pattern.angles.iter().map(read).collect();
        let coefficients = pattern.fit(&[ETA; BASES], &readings);
        let at = ComponentsAt::new(&basis, directions.clone());
        let errors = directions.iter().enumerate().map(|(direction, angles)| {
            let cosine = at.cos_theta_i[direction];
            let modeled = at.brdf(direction, &coefficients);
            let measured = material.at_angles(*angles);
            let channels = measured.iter().zip(modeled);
            let errors = channels.map(|(y, f)| ((y * cosine).ln_1p() - (f * cosine).ln_1p()).abs());
            f64::from(errors.sum::<f32>())
        });
        errors.sum::<f64>() / (3 * directions.len()) as f64
    });
    let losses: Vec<f64> = losses.collect();
    let mean = losses.iter().sum::<f64>() / losses.len() as f64;
    let error = (f64::from(estimate.loss) - mean).abs() / mean;
    assert!(error < 1e-4, "{} and {mean}", estimate.loss);
    assert_eq!(estimate.materials, MATERIALS);
}

/// A pattern of one sample may move below the horizon during training. Without a measurement, the fit is the mean, and
/// the barrier is the only gradient.
#[test]
fn gradient_without_valid_samples_is_the_barrier() {
    let below_horizon = Angles::from_array([1.5, 1.5, 0.1]);
    let values = MetaValues {
        pattern: Reach::ANY.logits(below_horizon).to_vec(),
        ..MetaValues::default()
    };
    let (loss, gradient) = objective().gradient(&values, STEP, SAMPLES);
    assert!(loss.is_finite() && loss > 0.0, "{loss}");
    let [theta_h, theta_d, phi_d] = gradient.pattern[..] else {
        panic!("one sample must have three logits");
    };
    assert!(
        theta_h > 0.0 && theta_d > 0.0,
        "descent must reduce both angles: {theta_h}, {theta_d}"
    );
    assert_eq!(phi_d, 0.0);
}
