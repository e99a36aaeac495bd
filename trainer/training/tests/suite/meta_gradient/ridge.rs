//! The objective of schedule paper for Linear: its gradient, its folds, and patterns without valid samples.

use glimpse_core::geometry::Angles;
use glimpse_core::model::linear::EPSILON;
use glimpse_fitting::linear::ComponentsAt;
use glimpse_fitting::recipe::options::TrainingOptions;
use glimpse_materials::Material;
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

/// The expected loss is that of ridge fits by normal equations, each with a basis of the other folds.
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
        let coefficients = fit(&pattern, &**material);
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

/// Solves the normal equations of each channel by elimination.
fn fit(at: &ComponentsAt, material: &dyn Material) -> Vec<f32> {
    let count = at.components;
    let channels = (0..3).flat_map(|channel| {
        let mapped = at.angles.iter().enumerate().map(|(sample, angles)| {
            let y = f64::from(material.at_angles(*angles)[channel]);
            let weight = f64::from(at.cosines[sample].value);
            ((y * weight + EPSILON) / EPSILON).ln() - f64::from(at.mean[sample].value)
        });
        let mapped: Vec<f64> = mapped.collect();
        let rows: Vec<f64> = at.rows.iter().copied().map(f64::from).collect();
        let rows = nalgebra::DMatrix::from_row_slice(at.count(), count, &rows);
        let eta = nalgebra::DMatrix::identity(count, count) * f64::from(ETA);
        let matrix = rows.tr_mul(&rows) + eta;
        let right = rows.tr_mul(&nalgebra::DVector::from_vec(mapped));
        let solution = matrix.lu().solve(&right).expect("the matrix is regular");
        let list: Vec<f32> = solution.iter().map(|entry| *entry as f32).collect();
        list
    });
    channels.collect()
}

/// A pattern of one sample may move below the horizon during training. Without a measurement, the fit is the mean, and
/// the barrier is the only gradient.
#[test]
fn gradient_without_valid_samples_is_the_barrier() {
    let below_horizon = Angles {
        theta_h: 1.5,
        theta_d: 1.5,
        phi_d: 0.1,
    };
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
