//! Detection of outliers, on materials that are not part of the statistics.

use glimpse_core::geometry::Angles;
use glimpse_core::model::ModelKind;
use glimpse_fitting::measurement::{NamedRecipe, OutlierReport};
use glimpse_materials::{Brdf, Procedural};
use glimpse_training::linear::{CoefficientPrior, PosteriorReading};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::recipe;

/// A change to one reading.
#[derive(Clone, Copy, Debug)]
enum Corruption {
    None,
    /// Multiplies all channels by a factor.
    Factor(f32),
    /// Multiplies one channel by ten.
    OneChannel,
}

/// The bundled prior.
fn prior() -> CoefficientPrior {
    let linear = NamedRecipe::bundled(ModelKind::Linear).expect("a bundled recipe");
    linear.at(&[], &[]).expect("no directions").prior
}

fn find_outliers(
    prior: &CoefficientPrior,
    pattern: &[Angles<f32>],
    readings: &[Option<[f32; 3]>],
) -> OutlierReport {
    let readings = pattern.iter().zip(readings);
    let readings = readings.map(|(angles, brdf)| Some(PosteriorReading::new(*angles, (*brdf)?)));
    OutlierReport::new(prior, &readings.collect::<Vec<_>>())
}

/// Returns the rate of detected corrupt readings, and the rate of materials with false positives, over procedural
/// materials with 2 % noise and one missing reading.
fn rates(name: &str, corruption: Corruption) -> [f64; 2] {
    let file = recipe(name);
    let recipe = file.recipe();
    let prior = prior();
    let pattern: Vec<Angles<f32>> = recipe.pattern().collect();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let materials = Procedural::set(100, 77);
    let (mut detected, mut false_positives) = (0, 0);
    for material in &materials {
        let mut readings: Vec<Option<[f32; 3]>> = pattern
            .iter()
            .map(|angles| {
                let mut noisy = |f: f32| f * (1.0 + 0.02 * random.sample::<f32, _>(StandardNormal));
                Some(material.at_angles(*angles).map(&mut noisy))
            })
            .collect();
        let lost = random.random_range(0..pattern.len());
        readings[lost] = None;
        let bad = (lost + random.random_range(1..pattern.len())) % pattern.len();
        let reading = readings[bad].as_mut().expect("a reading");
        match corruption {
            Corruption::None => {}
            Corruption::Factor(factor) => *reading = reading.map(|f| factor * f),
            Corruption::OneChannel => reading[1] *= 10.0,
        }
        let OutlierReport {
            outliers,
            predictions,
            ..
        } = find_outliers(&prior, &pattern, &readings);
        assert_eq!(
            predictions
                .iter()
                .filter(|prediction| prediction.is_none())
                .count(),
            1
        );
        let is_bad = |sample: usize| sample == bad && !matches!(corruption, Corruption::None);
        detected += usize::from(outliers.iter().any(|sample| is_bad(*sample)));
        false_positives += usize::from(outliers.iter().any(|sample| !is_bad(*sample)));
    }
    let share = |count: usize| count as f64 / materials.len() as f64;
    println!(
        "{name} {corruption:?}: detected {:.2}, false positives {:.2}",
        share(detected),
        share(false_positives)
    );
    [share(detected), share(false_positives)]
}

#[test]
fn detects_tenfold_readings() {
    for (name, min_rate) in [
        ("masked/linear-n16.recipe", 0.95),
        ("masked/neural-n16.recipe", 0.95),
        ("completed/linear-n8.recipe", 0.8),
        ("completed/phong-n8.recipe", 0.8),
        ("paper/neural-n8.recipe", 0.8),
        ("paper/cook-torrance-n8.recipe", 0.8),
    ] {
        let [_, false_positives] = rates(name, Corruption::None);
        assert!(false_positives <= 0.08, "{name}: {false_positives}");
        let [detected, false_positives] = rates(name, Corruption::Factor(10.0));
        assert!(
            detected >= min_rate && false_positives <= 0.15,
            "{name}: {detected} {false_positives}"
        );
    }
}

#[test]
fn detects_small_readings_and_single_channels() {
    let name = "masked/linear-n16.recipe";
    let [detected, _] = rates(name, Corruption::Factor(0.1));
    assert!(detected >= 0.75, "{detected}");
    let [detected, _] = rates(name, Corruption::OneChannel);
    assert!(detected >= 0.85, "{detected}");
}

#[test]
fn at_most_a_quarter_are_outliers() {
    let file = recipe("masked/linear-n16.recipe");
    let recipe = file.recipe();
    let (prior, pattern) = (prior(), recipe.pattern().collect::<Vec<_>>());
    let extreme: Vec<Option<[f32; 3]>> = (0..recipe.samples())
        .map(|index| Some([if index % 2 == 0 { 1e-4 } else { 50.0 }; 3]))
        .collect();
    assert_eq!(find_outliers(&prior, &pattern, &extreme).outliers.len(), 4);
    // Three readings or fewer have no outliers.
    let mut few = vec![None; recipe.samples()];
    assert_eq!(find_outliers(&prior, &pattern, &few).outliers, [0; 0]);
    few[..3].copy_from_slice(&extreme[..3]);
    assert_eq!(find_outliers(&prior, &pattern, &few).outliers, [0; 0]);
}
