//! A block of samples is what its samples are one by one, bit for bit.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{CookTorrance, Model, Neural, ParameterSet, Phong, Sample};
use glimpse_core::numeric::Block;
use proptest::prelude::*;

fn sample() -> impl Strategy<Value = Sample<f32>> {
    let angles = (0.0..1.5_f32, 0.0..1.5_f32, 0.0..3.1_f32);
    (angles, [0.0..3.0_f32, 0.0..3.0, 0.0..3.0], 0.01..1.0_f32).prop_map(
        |((theta_h, theta_d, phi_d), measured, weight)| Sample {
            at: HalfDifference::from_angles(Angles {
                theta_h,
                theta_d,
                phi_d,
            }),
            measured,
            weight,
        },
    )
}

fn compare<M: Model>(values: &[f32], samples: &[Sample<f32>]) {
    let mut parameters = M::ZEROS;
    for (parameter, value) in parameters.iter_mut().zip(values.iter().cycle()) {
        *parameter = *value;
    }
    let (mut together, mut apart) = (M::ZEROS, M::ZEROS);
    let block = Sample::<Block<4>>::gather(samples);
    let losses = M::accumulate_gradient::<_, false>(&parameters, &block, &mut together).loss();
    for (index, sample) in samples.iter().enumerate() {
        let found = M::accumulate_gradient::<f32, false>(&parameters, sample, &mut apart);
        assert_eq!(losses.0[index].to_bits(), found.loss().to_bits());
    }
    // Those that stand in for missing ones count for nothing.
    assert!(losses.0[samples.len()..].iter().all(|loss| *loss == 0.0));
    for (index, (together, apart)) in together.iter().zip(apart.iter()).enumerate() {
        assert_eq!(together, apart, "entry {index} of {}", M::KIND);
    }
}

proptest! {
    #[test]
    fn together_or_one_by_one(
        values in prop::collection::vec(-0.6..0.6_f32, 31),
        samples in prop::collection::vec(sample(), 1..=4),
    ) {
        compare::<Phong>(&values, &samples);
        compare::<CookTorrance>(&values, &samples);
        compare::<Neural>(&values, &samples);
    }
}
