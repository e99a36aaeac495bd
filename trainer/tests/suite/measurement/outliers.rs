//! Which readings look wrong, on materials that the statistics were not made of.

use glimpse_core::geometry::Angles;
use glimpse_materials::{Material, Procedural};
use glimpse_trainer::measurement::{Distribution, Examined};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::recipe;

/// What is made of one reading.
#[derive(Clone, Copy, Debug)]
enum Spoilt {
    Nothing,
    /// All channels times a number.
    Times(f32),
    /// One channel ten times too large.
    OneChannel,
}

/// Of procedural materials with 2 % noise and one reading lost: how often a reading that was spoilt is
/// named, and how often one that was not.
fn rates(name: &str, spoilt: Spoilt) -> [f64; 2] {
    let file = recipe(name);
    let recipe = file.recipe();
    let distribution = Distribution::new(&recipe).expect("it is not too large");
    let pattern: Vec<Angles<f32>> = recipe.pattern().collect();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let materials = Procedural::set(100, 77);
    let (mut named, mut others) = (0, 0);
    for material in &materials {
        let mut readings: Vec<Option<[f32; 3]>> = pattern
            .iter()
            .map(|angles| {
                let mut noisy = |f: f32| f * (1.0 + 0.02 * random.sample::<f32, _>(StandardNormal));
                Some(material.brdf(*angles).map(&mut noisy))
            })
            .collect();
        let lost = random.random_range(0..pattern.len());
        readings[lost] = None;
        let bad = (lost + random.random_range(1..pattern.len())) % pattern.len();
        let reading = readings[bad].as_mut().expect("it is there");
        match spoilt {
            Spoilt::Nothing => {}
            Spoilt::Times(factor) => *reading = reading.map(|f| factor * f),
            Spoilt::OneChannel => reading[1] *= 10.0,
        }
        let Examined {
            suspects, opinions, ..
        } = distribution.examine(&readings);
        assert_eq!(opinions.iter().filter(|one| one.is_none()).count(), 1);
        let is_bad = |sample: usize| sample == bad && !matches!(spoilt, Spoilt::Nothing);
        named += usize::from(suspects.iter().any(|one| is_bad(one.sample)));
        others += usize::from(suspects.iter().any(|one| !is_bad(one.sample)));
    }
    let share = |count: usize| count as f64 / materials.len() as f64;
    println!(
        "{name} {spoilt:?}: {:.2}, others {:.2}",
        share(named),
        share(others)
    );
    [share(named), share(others)]
}

#[test]
fn a_reading_ten_times_too_large_is_named_and_others_are_not() {
    for (name, least) in [
        ("masked/linear-n16.recipe", 0.95),
        ("masked/neural-n16.recipe", 0.95),
        ("completed/linear-n8.recipe", 0.8),
        ("completed/phong-n8.recipe", 0.8),
        // They say nothing of what they were trained on.
        ("neural-n8.recipe", 0.8),
        ("cook-torrance-n8.recipe", 0.8),
    ] {
        let [_, alarms] = rates(name, Spoilt::Nothing);
        assert!(alarms <= 0.08, "{name}: {alarms}");
        let [named, others] = rates(name, Spoilt::Times(10.0));
        assert!(named >= least && others <= 0.15, "{name}: {named} {others}");
    }
}

#[test]
fn one_that_is_too_small_or_of_one_channel_is_named_too() {
    let name = "masked/linear-n16.recipe";
    let [named, _] = rates(name, Spoilt::Times(0.1));
    assert!(named >= 0.75, "{named}");
    let [named, _] = rates(name, Spoilt::OneChannel);
    assert!(named >= 0.85, "{named}");
}

#[test]
fn at_most_a_quarter_of_the_readings_looks_wrong() {
    let file = recipe("masked/linear-n16.recipe");
    let recipe = file.recipe();
    let distribution = Distribution::new(&recipe).expect("it is not too large");
    let absurd: Vec<Option<[f32; 3]>> = (0..recipe.samples())
        .map(|index| Some([if index % 2 == 0 { 1e-4 } else { 50.0 }; 3]))
        .collect();
    assert_eq!(distribution.examine(&absurd).suspects.len(), 4);
    // Of three readings none is called wrong, whatever they are; nor is nothing an error.
    let mut few = vec![None; recipe.samples()];
    assert_eq!(distribution.examine(&few).suspects, []);
    few[..3].copy_from_slice(&absurd[..3]);
    assert_eq!(distribution.examine(&few).suspects, []);
}
