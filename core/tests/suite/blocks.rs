//! A block of samples gives the same bits as single samples.

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::{
    CookTorrance, Model, Neural, ParameterSet, Phong, Sample, Samples, Slot, slot_of,
};
use proptest::prelude::*;

fn sample() -> impl Strategy<Value = Sample<f32>> {
    let angles = (0.0..1.5_f32, 0.0..1.5_f32, 0.0..3.1_f32);
    (angles, [0.0..3.0_f32, 0.0..3.0, 0.0..3.0]).prop_map(
        |((theta_h, theta_d, phi_d), measured)| Sample {
            at: HalfDifference::from_angles(Angles {
                theta_h,
                theta_d,
                phi_d,
            }),
            measured,
            weight: 0.25,
        },
    )
}

fn compare<M: Model>(values: &[f32], samples: &[Sample<f32>]) {
    let mut parameters = M::Parameters::filled(0.0);
    for (parameter, value) in parameters
        .as_mut_slice()
        .iter_mut()
        .zip(values.iter().cycle())
    {
        *parameter = *value;
    }
    let zeros = M::Parameters::filled(0.0);
    let (mut in_block, mut one_by_one) = (zeros.clone(), zeros);
    let slots: Vec<Slot> = samples
        .iter()
        .map(|sample| slot_of(&sample.at, sample.measured))
        .collect();
    let block = Samples::new(&slots, samples[0].weight).gather::<4>();
    let losses = M::accumulate_gradient::<_, false>(&parameters, &block, &mut in_block).loss();
    for (index, sample) in samples.iter().enumerate() {
        let actual = M::accumulate_gradient::<f32, false>(&parameters, sample, &mut one_by_one);
        assert_eq!(losses.0[index].to_bits(), actual.loss().to_bits());
    }
    // Padding samples have no loss.
    assert!(losses.0[samples.len()..].iter().all(|loss| *loss == 0.0));
    for (index, (in_block, one_by_one)) in in_block
        .as_slice()
        .iter()
        .zip(one_by_one.as_slice())
        .enumerate()
    {
        assert_eq!(in_block, one_by_one, "entry {index} of {}", M::KIND);
    }
}

proptest! {
    #[test]
    fn block_matches_single_samples(
        values in prop::collection::vec(-0.6..0.6_f32, 31),
        samples in prop::collection::vec(sample(), 1..=4),
    ) {
        compare::<Phong>(&values, &samples);
        compare::<CookTorrance>(&values, &samples);
        compare::<Neural>(&values, &samples);
    }
}
