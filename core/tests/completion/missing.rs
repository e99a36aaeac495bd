//! Readings that are missing or saturated: which recipes can do without them, and what is left.

use glimpse_core::fit::completion::{Missing, gain};
use glimpse_core::fit::{AnyModel, Fitter};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{FitError, Memory, Reading, Scan};

use super::made::{MODELS, Made, SAMPLES, WORDS};
use super::reference::{
    Readings, all, assert_close, assert_close_to_one_of, colour, fitted_either_way,
};
use super::scans::{fit, whole, whole_by_name};

type Any = AnyModel<WORDS>;

/// Those of a mask.
fn subset(present: u32) -> Readings {
    let mut readings = all(SAMPLES);
    for (sample, reading) in readings.iter_mut().enumerate() {
        if present >> sample & 1 == 0 {
            *reading = None;
        }
    }
    readings
}

/// Calls `check` with an empty scan by a recipe of each model.
fn each(missing: Missing, check: impl Fn(&Made, &mut Scan<'_, '_, Any, SAMPLES>)) {
    for kind in MODELS {
        let made = Made::small(kind, missing);
        let bytes = made.write().unwrap();
        let recipe = Recipe::parse(&bytes).unwrap();
        let mut memory = Memory::<Any, SAMPLES>::new();
        check(&made, &mut Scan::new(recipe, &mut memory).unwrap());
    }
}

#[test]
fn a_recipe_that_needs_all_readings_says_which_is_missing() {
    each(Missing::NoFit, |made, scan| {
        for index in [0, 2, 1, 5, 4, 3] {
            let (first, _) = scan.next_pending().unwrap();
            let missing = scan.pending().count() as u16;
            let error = FitError::Incomplete { missing, first };
            assert_eq!(scan.fit().err(), Some(error));
            scan.record(index, Reading::new(colour(index.into())))
                .unwrap();
        }
        assert_eq!(fit(scan, &[7]), whole_by_name(made, &all(SAMPLES)));
    });
}

/// That it was trained without some makes no difference where all are there.
#[test]
fn with_all_readings_all_fit_alike() {
    for kind in MODELS {
        let [without, alike, more] = [Missing::NoFit, Missing::CountAlike, Missing::CountForMore]
            .map(|missing| whole_by_name(&Made::small(kind, missing), &all(SAMPLES)));
        assert_eq!(alike, without);
        assert_eq!(more, without);
    }
}

/// After each reading the fit goes by those that are there; the order does not count.
#[test]
fn one_reading_is_enough_and_each_further_one_counts() {
    each(Missing::CountForMore, |made, scan| {
        let (missing, first) = (SAMPLES as u16, 0);
        let error = FitError::Incomplete { missing, first };
        assert_eq!(scan.fit().err(), Some(error));
        let mut present = 0;
        let mut before = None;
        for index in [3, 5, 0, 1, 4, 2] {
            scan.record(index, Reading::new(colour(index.into())))
                .unwrap();
            present |= 1 << index;
            let found = fit(scan, &[4]);
            assert_eq!(found, whole_by_name(made, &subset(present)));
            assert_ne!(Some(&found), before.as_ref());
            let pending: Vec<u16> = scan.pending().map(|(index, _)| index).collect();
            let expected: Vec<u16> = (0..6).filter(|k| present >> k & 1 == 0).collect();
            assert_eq!(pending, expected);
            before = Some(found);
        }
    });
}

#[test]
fn any_subset_is_what_the_formulas_say() {
    for missing in [Missing::CountAlike, Missing::CountForMore] {
        let made = Made::small(ModelKind::Linear, missing);
        let bytes = made.write().unwrap();
        let recipe = Recipe::parse(&bytes).unwrap();
        for present in 1..64 {
            let readings = subset(present);
            let (values, _) = whole::<Any>(&made, &readings);
            let expected = fitted_either_way(&made, &recipe, &readings);
            assert_close_to_one_of("coefficients", &values, &expected);
        }
    }
}

/// sqrt(n / k).
#[test]
fn the_gain_is_the_root_of_the_share_that_is_missing() {
    for samples in 1..=64_usize {
        for present in 1..=samples {
            let expected = (samples as f64 / present as f64).sqrt();
            assert_close("gain", [gain(samples, present)].into_iter(), &[expected]);
            let there = (0..samples).map(|sample| sample < present);
            let alike = [Missing::NoFit, Missing::CountAlike];
            assert_eq!(alike.map(|each| each.gain(there.clone())), [1.0; 2]);
            let more = Missing::CountForMore.gain(there);
            assert_eq!(more, gain(samples, present));
        }
        // No more than what there is, and nothing to multiply.
        assert_eq!([gain(samples, samples), gain(samples, 0)], [1.0; 2]);
    }
}

fn saturated(index: u16) -> Reading {
    Reading {
        saturated: true,
        ..Reading::new(colour(index.into()))
    }
}

#[test]
fn a_saturated_reading_is_left_out_where_others_are_there() {
    each(Missing::CountForMore, |made, scan| {
        for index in 0..SAMPLES as u16 {
            let reading = match index {
                1 | 4 => saturated(index),
                _ => Reading::new(colour(index.into())),
            };
            scan.record(index, reading).unwrap();
        }
        let (values, residual) = fit(scan, &[5]);
        let (expected, _) = whole_by_name(made, &subset(0b10_1101));
        assert_eq!(values, expected);
        // The residual has seen them nevertheless.
        assert_eq!(residual.saturated, 2);
        // A second reading, with less light, counts.
        scan.record(1, Reading::new(colour(1))).unwrap();
        let (expected, _) = whole_by_name(made, &subset(0b10_1111));
        assert_eq!(fit(scan, &[5]).0, expected);
    });
}

#[test]
fn if_all_are_saturated_they_count() {
    each(Missing::CountForMore, |made, scan| {
        for index in [2, 3] {
            scan.record(index, saturated(index)).unwrap();
        }
        let (values, residual) = fit(scan, &[5]);
        let (expected, clear) = whole_by_name(made, &subset(0b1100));
        assert_eq!(values, expected);
        assert_eq!((residual.mean, residual.saturated), (clear.mean, 2));
        // Not any more once there is one that is not.
        scan.record(0, Reading::new(colour(0))).unwrap();
        assert_eq!(fit(scan, &[5]).0, whole_by_name(made, &subset(1)).0);
    });
}

/// A recipe that needs all readings counts them all, saturated or not.
#[test]
fn a_recipe_that_needs_all_readings_counts_saturated_ones() {
    each(Missing::NoFit, |made, scan| {
        for index in 0..SAMPLES as u16 {
            scan.record(index, saturated(index)).unwrap();
        }
        scan.record(0, Reading::new(colour(0))).unwrap();
        let (values, residual) = fit(scan, &[5]);
        assert_eq!(values, whole_by_name(made, &all(SAMPLES)).0);
        assert_eq!(residual.saturated, 5);
    });
}

#[test]
fn a_restart_forgets() {
    each(Missing::CountForMore, |made, scan| {
        // Readings so large that a fit of them is refused.
        for index in 0..SAMPLES as u16 {
            scan.record(index, Reading::new([1e4; 3])).unwrap();
        }
        assert!(matches!(
            scan.fit().err(),
            Some(FitError::Implausible { .. })
        ));
        scan.restart();
        let (missing, first) = (SAMPLES as u16, 0);
        let error = FitError::Incomplete { missing, first };
        assert_eq!(scan.fit().err(), Some(error));
        // What was read before is neither fitted nor looked at.
        scan.record(2, Reading::new(colour(2))).unwrap();
        assert_eq!(scan.reading(0), None);
        assert_eq!(fit(scan, &[5]), whole_by_name(made, &subset(0b100)));
    });
}

/// Counts instead of BRDFs are refused among few readings as among all of them.
#[test]
fn implausible_readings_are_told_from_those_that_are_there() {
    each(Missing::CountForMore, |_, scan| {
        for index in [0, 2, 3, 5] {
            assert!(scan.fit().is_ok() || index == 0);
            scan.record(index, Reading::new([1e4; 3])).unwrap();
        }
        assert!(matches!(
            scan.fit().err(),
            Some(FitError::Implausible { .. })
        ));
    });
}

/// The mean is over the readings that are there, not over the pattern.
#[test]
fn the_residual_counts_what_was_read() {
    each(Missing::CountForMore, |_, scan| {
        scan.record(4, Reading::new(colour(4))).unwrap();
        let (_, residual) = fit(scan, &[5]);
        assert_eq!((residual.mean, residual.worst_index), (residual.worst, 4));
        assert!(residual.mean > 0.0);
        scan.record(1, Reading::new(colour(4))).unwrap();
        let (_, residual) = fit(scan, &[5]);
        assert!(residual.mean > residual.worst / 2.0 && residual.mean < residual.worst);
        // Alike, with others between them in the pattern that are not there.
        assert_eq!(residual.repeated, 1);
    });
}

/// A reading below what the logarithm can take is brought up, and does not end in a NaN.
#[test]
fn dark_readings_are_brought_up() {
    fn check<K: Fitter>(made: &Made) {
        let bytes = made.write().unwrap();
        let recipe = Recipe::parse(&bytes).unwrap();
        let mut memory = Memory::<K, SAMPLES>::new();
        let mut scan = Scan::new(recipe, &mut memory).unwrap();
        let recorded = scan.record(3, Reading::new([-0.5, 0.1, 0.1])).unwrap();
        assert!(recorded.clamped);
        let (values, residual) = fit(&mut scan, &[5]);
        assert!(values.iter().all(|value| value.is_finite()));
        assert_eq!(residual.clamped, 1);
        // Brought up to where y w + e is e / 2, or y cos(theta_i) is -1/2.
        let (_, directions) = recipe.directions().nth(3).unwrap();
        let (cosine, other) = (directions.incoming[2], directions.outgoing[2]);
        let least = (-0.0005 / (cosine * other)).max(-0.5 / cosine);
        let found = scan.reading(3).unwrap().brdf[0];
        assert!(
            (found - least).abs() < 1e-6 * least.abs(),
            "{found} {least}"
        );
        let mut readings = vec![None; SAMPLES];
        readings[3] = Some([found, 0.1, 0.1]);
        assert_eq!(whole::<K>(made, &readings).0, values);
    }
    for kind in MODELS {
        check::<Any>(&Made::small(kind, Missing::CountForMore));
    }
}
