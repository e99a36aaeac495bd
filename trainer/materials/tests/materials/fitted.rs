//! Fitted materials and networks: their file, derivatives, and discovery in directories.

use std::fs;
use std::sync::LazyLock;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{Model, ModelKind, Neural, NeuralParameters, ParameterSet};
use glimpse_kernels::AngleDual;
use glimpse_kernels::Dual;
use glimpse_materials::basis::BasisTable;
use glimpse_materials::sampling::uniform_valid;
use glimpse_materials::{BasisFile, Brdf, FittedBrdf, FittedMaterial, MODELS, Material, Source};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::folder::Folder;
use crate::{network, with_derivative};

static BASIS: LazyLock<BasisTable> = LazyLock::new(|| {
    let bytes = include_bytes!("../../../recipes/linear.basis24");
    BasisTable::parse(bytes).expect("a valid basis")
});

fn fitted(model: ModelKind, seed: u64) -> FittedMaterial {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let count = model.parameters().unwrap_or(3 * BASIS.components());
    let values = (0..count).map(|_| random.random_range(-0.5..0.5_f32));
    let name = format!("{model} {seed}");
    let fitted = FittedBrdf::new(model, values.collect(), Some(&BASIS));
    FittedMaterial::new(name, fitted.expect("the number of values is right"))
        .expect("the values are finite")
}

#[test]
fn file_keeps_every_bit() {
    let scratch = Folder::new();
    scratch.write("a.basis", BASIS.file());
    let basis = BasisFile::new("../a.basis".to_owned(), BASIS.checksum());
    for (seed, model) in (0..4).zip(MODELS) {
        let material = fitted(model, seed);
        let basis = (model == ModelKind::Linear).then_some(&basis);
        let metadata = serde_json::json!({ "residual": 0.5 });
        let folder = scratch.at(model.name());
        fs::create_dir(&folder).expect("the directory is created");
        let text = material
            .to_json(basis, metadata)
            .expect("the material is serialized");
        let path = scratch.write(&format!("{model}/material.json"), text);

        // The source is the file or its folder. The material has the name in the file.
        for source in [&path, &folder] {
            let source = Source(source.display().to_string());
            let loaded = source.load().expect("the source is loaded");
            let [loaded] = &loaded[..] else {
                panic!("not one material in {source}")
            };
            assert_eq!(loaded.name(), format!("{model} {seed}"));
            for angles in uniform_valid(200, seed) {
                assert_eq!(loaded.at_angles(angles), material.at_angles(angles));
            }
            let files = source.files().expect("the files are listed");
            assert_eq!(files.len(), if basis.is_some() { 2 } else { 1 });
        }
        let read = FittedMaterial::read(&path).expect("the file is read");
        assert_eq!(read.fitted(), material.fitted());
    }
    let all = Source(scratch.path().display().to_string());
    assert_eq!(all.load().expect("the directory is loaded").len(), 4);
    let skipped = all.skipped_entries().expect("the directory is listed");
    assert!(skipped.is_empty(), "{skipped:?}");
}

#[test]
fn derivatives_match_finite_differences() {
    for (seed, model) in (0..4).zip(MODELS) {
        let material = fitted(model, seed);
        let mut wrong = 0;
        for angles in uniform_valid(200, seed) {
            let (value, derivative) = with_derivative(&material, angles);
            let scale = value
                .iter()
                .fold(0.1_f32, |largest, f| largest.max(f.abs()));
            let step = 2e-3_f32;
            let moved = |axis: usize, step: f32| {
                let mut moved = angles.to_array();
                moved[axis] += step;
                material.at_angles(Angles::from_array(moved))
            };
            let differences = [0, 1, 2].map(|axis| {
                let (up, down) = (moved(axis, step), moved(axis, -step));
                [0, 1, 2].map(|channel: usize| (up[channel] - down[channel]) / (2.0 * step))
            });
            for (axis, channels) in differences.into_iter().enumerate() {
                for (difference, derivative) in channels.into_iter().zip(derivative) {
                    let error = (difference - derivative[axis]).abs();
                    wrong += usize::from(error > 0.02 * (derivative[axis].abs() + scale));
                }
            }
        }
        // Steps across a kink have large errors. Networks have kinks, and interpolation has many.
        let max_wrong = if model == ModelKind::Linear { 450 } else { 90 };
        assert!(wrong < max_wrong, "{model}: {wrong} of 1800");
    }
}

/// Compares derivatives in f32 with dual numbers in f64.
#[test]
fn network_derivatives_match_f64() {
    for seed in 0..20 {
        let network = network(seed);
        let mut weights = NeuralParameters::filled(AngleDual::from_value(0.0));
        for (weight, value) in weights.iter_mut().zip(network.parameters().iter()) {
            weight.value = (*value).into();
        }
        let angles = uniform_valid(100, seed);
        let results = network.with_derivatives(&angles);
        for (angles, (values, derivative)) in angles.into_iter().zip(results) {
            let at = HalfDifference::from_angles(Dual::variables(angles.map(f64::from)));
            let (expected_values, expected) =
                Dual::split(Neural::brdf::<AngleDual<f64>>(&weights, &at));
            let actual = values.iter().chain(derivative.as_flattened());
            let expected = expected_values.iter().chain(expected.as_flattened());
            for (actual, expected) in actual.zip(expected) {
                let error = (f64::from(*actual) - expected).abs();
                assert!(
                    error < 1e-4 * (1.0 + expected.abs()),
                    "network {seed} at {angles:?}: {actual}, {expected}"
                );
            }
        }
    }
}
