//! The self-test recognizes the quantity of a tile's readings, or reports that it is inconclusive.

use std::f32::consts::PI;

use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::geometry::Directions;
use glimpse_core::gonio::Quantity;
use glimpse_core::gonio::tile::{TileResult, examine};

use super::at;
use crate::random::Random;

const TILE: [f32; 3] = [0.5, 0.42, 0.36];
const ALL: [Quantity; 4] = [
    Quantity::Brdf,
    Quantity::BrdfTimesCosThetaI,
    Quantity::BrdfTimesCosThetaO,
    Quantity::ReflectanceFactor,
];

/// The directions of a tile's readings: theta_i and theta_o independently over 0 to 60 degrees.
fn directions(count: usize, random: &mut Random) -> Vec<Directions<f32>> {
    let step = 60.0 / count as f32;
    (0..count)
        .map(|index| {
            // 3 is coprime to the counts in use, so that each value occurs once.
            let other = (index * 3 + 1) % count;
            at([
                (index as f32 + random.uniform() as f32) * step,
                0.0,
                (other as f32 + random.uniform() as f32) * step,
                40.0 + 100.0 * random.uniform() as f32,
            ])
        })
        .collect()
}

struct Case {
    quantity: Quantity,
    factor: [f32; 3],
    noise: f32,
    monochrome: bool,
}

impl Case {
    /// The reflectances of the tile.
    fn tile(&self) -> [f32; 3] {
        if self.monochrome { [TILE[0]; 3] } else { TILE }
    }
}

/// Exact BRDFs.
const EXACT: Case = Case {
    quantity: Quantity::Brdf,
    factor: [1.0; 3],
    noise: 0.0,
    monochrome: false,
};

/// Readings of the tile by a scanner that yields `quantity` times `factor`, with noise.
fn readings(
    case: &Case,
    directions: &[Directions<f32>],
    random: &mut Random,
) -> Vec<(Directions<f32>, [f32; 3])> {
    let tile = case.tile();
    let read = |at: &Directions<f32>| {
        let values = case.quantity.of_brdf(tile.map(|r| r / PI), at);
        let values = values.expect("above the horizon");
        let common = random.normal() as f32;
        let read = std::array::from_fn(|c| {
            let noise = if case.monochrome {
                common
            } else {
                random.normal() as f32
            };
            values[c] * case.factor[c] * (1.0 + case.noise * noise)
        });
        (*at, read)
    };
    directions.iter().map(read).collect()
}

/// True for the correct result of a case, false for a wrong one.
fn is_correct(case: &Case, result: TileResult) -> bool {
    let is_scaled = case.factor != [1.0; 3];
    match result {
        TileResult::Is(quantity) => !is_scaled && quantity == case.quantity,
        TileResult::Scaled { quantity, factor } => {
            let mut factors = factor.iter().zip(case.factor);
            let is_close = factors.all(|(a, b)| (a / b - 1.0).abs() < 0.1);
            is_scaled && quantity == case.quantity && is_close
        }
        result => panic!("{result}"),
    }
}

/// With more noise, more results are inconclusive, but none is wrong.
#[test]
fn recognizes_eight_noisy_readings() {
    for (noise, factor, min_correct) in [
        (0.03, [1.0; 3], 2000),
        (0.03, [2.0; 3], 1500),
        (0.03, [0.8, 1.0, 1.3], 1500),
        (0.05, [1.0; 3], 1800),
        (0.1, [1.0; 3], 0),
        (0.3, [1.0; 3], 0),
    ] {
        for monochrome in [false, true] {
            let (mut random, mut correct) = (Random(1), 0);
            for quantity in ALL {
                if factor != [1.0; 3] && quantity == Quantity::ReflectanceFactor {
                    continue;
                }
                let case = Case {
                    quantity,
                    factor,
                    noise,
                    monochrome,
                };
                for _ in 0..500 {
                    let directions = directions(8, &mut random);
                    let readings = readings(&case, &directions, &mut random);
                    // An error is an inconclusive result.
                    if let Ok(result) = examine(&readings, case.tile()) {
                        assert!(is_correct(&case, result), "{noise} {factor:?} {quantity}");
                        correct += 1;
                    }
                }
            }
            assert!(correct >= min_correct, "{noise} {factor:?}: {correct}");
        }
    }
}

#[test]
fn three_exact_readings_are_enough() {
    let directions = [
        at([5.0, 0.0, 30.0, 90.0]),
        at([55.0, 0.0, 10.0, 90.0]),
        at([30.0, 0.0, 60.0, 120.0]),
    ];
    let mut random = Random(1);
    for quantity in ALL {
        let case = Case { quantity, ..EXACT };
        let readings = readings(&case, &directions, &mut random);
        assert_eq!(examine(&readings, TILE), Ok(TileResult::Is(quantity)));
        let two = readings.get(..2).expect("three readings");
        assert_eq!(examine(two, TILE), Err(Error::new(ErrorCode::TileTooFew)));
    }
    assert_eq!(examine(&[], TILE), Err(Error::new(ErrorCode::TileTooFew)));
}

/// Exact readings, but at directions that do not exclude other quantities.
#[test]
fn similar_directions_are_ambiguous() {
    let angles = [0.0, 15.0, 30.0, 45.0, 60.0];
    let mirror = angles.map(|theta| at([theta, 0.0, theta, 180.0]));
    let fixed_sensor = angles.map(|theta| at([theta, 0.0, 45.0, 90.0]));
    let fixed_light = angles.map(|theta| at([45.0, 0.0, theta, 90.0]));
    let narrow = angles.map(|theta| at([theta / 10.0, 0.0, 6.0 - theta / 10.0, 90.0]));
    for (directions, quantity) in [
        (mirror, Quantity::BrdfTimesCosThetaI),
        (fixed_sensor, Quantity::Brdf),
        (fixed_light, Quantity::Brdf),
        (narrow, Quantity::Brdf),
    ] {
        let case = Case { quantity, ..EXACT };
        let readings = readings(&case, &directions, &mut Random(1));
        let expected = Err(Error::new(ErrorCode::TileAmbiguous));
        assert_eq!(examine(&readings, TILE), expected);
    }
}

#[test]
fn unknown_quantity_is_inconclusive() {
    let mut random = Random(3);
    let directions = directions(10, &mut random);
    let examined = |brdf: &dyn Fn(&Directions<f32>) -> f32| {
        let readings = directions
            .iter()
            .map(|at| (*at, TILE.map(|r| r / PI * brdf(at))));
        examine(&readings.collect::<Vec<_>>(), TILE)
    };
    let result = examined(&|at| 0.2 + at.incoming[0].abs());
    assert!(
        result.is_err_and(|error| error.code == ErrorCode::TileSpread && error.details[0] > 8),
        "{result:?}"
    );
    assert!(examined(&|at| at.incoming[2] * at.outgoing[2]).is_err());
}

#[test]
fn names_invalid_readings_and_reflectances() {
    let directions = directions(8, &mut Random(2));
    let valid: Vec<_> = directions
        .iter()
        .map(|at| (*at, TILE.map(|r| r / PI)))
        .collect();
    assert_eq!(examine(&valid, TILE), Ok(TileResult::Is(Quantity::Brdf)));
    for value in [0.0, -0.01, f32::NAN, f32::INFINITY] {
        let mut broken = valid.clone();
        broken[5].1[2] = value;
        let expected = Err(Error::with(ErrorCode::TileReading, [5, 0]));
        assert_eq!(examine(&broken, TILE), expected);
    }
    let mut below = valid.clone();
    below[3].0.outgoing[2] *= -1.0;
    let expected = Err(Error::with(ErrorCode::TileReading, [3, 0]));
    assert_eq!(examine(&below, TILE), expected);
    for reflectance in [0.0, -0.5, 99.0, f32::NAN] {
        let result = examine(&valid, [0.5, reflectance, 0.5]);
        let expected = Err(Error::with(ErrorCode::WhiteReflectance, [1, 0]));
        assert_eq!(result, expected);
    }
}
