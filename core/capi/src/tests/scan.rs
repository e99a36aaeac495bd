//! Tests of complete scans.

use core::ptr::{null, null_mut};
use std::vec;
use std::vec::Vec;

use glimpse_core::fit::Uncertainty;
use glimpse_core::recipe::{PackedCorrection, PackedMethod, Recipe, RecipeParts};

use super::fit::finish;
use super::{AlignedMemory, CoreFit, MIRROR, RECIPES, begin, fit_with_core, reading, record_all};
use crate::fit::{
    glimpse_fit_advance, glimpse_fit_begin, glimpse_fit_finish, glimpse_fitted_brdf,
    glimpse_fitted_is_unlike_training, glimpse_fitted_loss_bound, glimpse_fitted_predicted_loss,
    glimpse_fitted_residual, glimpse_fitted_values,
};
use crate::recipe::glimpse_recipe_describe;
use crate::scan::{
    glimpse_scan, glimpse_scan_next, glimpse_scan_reading, glimpse_scan_record,
    glimpse_scan_restart,
};
use crate::status::glimpse_status as Status;
use crate::types::{
    glimpse_answer, glimpse_directions_of, glimpse_model, glimpse_reading, glimpse_recipe,
    glimpse_recorded, glimpse_residual, glimpse_sample,
};

/// Fits in small steps and returns the residual.
fn fit(scan: *mut glimpse_scan) -> glimpse_residual {
    assert_eq!(unsafe { glimpse_fit_begin(scan) }, Status::Ok);
    let (status, residual) = finish(scan);
    assert_eq!(status, Status::Ok);
    assert_eq!(residual.implausible, 0);
    residual
}

pub(super) fn describe(recipe: &[u8]) -> glimpse_recipe {
    let mut found = core::mem::MaybeUninit::uninit();
    unsafe {
        let status = glimpse_recipe_describe(recipe.as_ptr(), recipe.len(), found.as_mut_ptr());
        assert_eq!(status, Status::Ok);
        found.assume_init()
    }
}

/// Asserts that predicted loss, bound and similarity to the training equal core's.
fn assert_errors_match(scan: *const glimpse_scan, expected: &CoreFit) {
    let (mut loss, mut bound, mut unlike) = (0.0, 0.0, glimpse_answer::No);
    let found = unsafe {
        [
            glimpse_fitted_predicted_loss(scan, &raw mut loss),
            glimpse_fitted_loss_bound(scan, &raw mut bound),
            glimpse_fitted_is_unlike_training(scan, &raw mut unlike),
        ]
    };
    assert_eq!(found, [Status::Ok; 3]);
    let bits = |value: Option<f32>| value.unwrap_or(f32::NAN).to_bits();
    assert_eq!(loss.to_bits(), bits(expected.predicted_loss));
    assert_eq!(bound.to_bits(), bits(expected.loss_bound));
    let expected_answer = match expected.is_unlike_training {
        Some(false) => glimpse_answer::No,
        Some(true) => glimpse_answer::Yes,
        None => glimpse_answer::Unknown,
    };
    assert_eq!(unlike, expected_answer);
}

/// Fits with all models and kinds of recipes, one after the other in the same memory, have the same bits as core's.
#[test]
fn every_recipe_matches_core() {
    let mut memory = AlignedMemory::for_scan();
    let mut predicted_count = 0;
    for recipe in RECIPES {
        let (status, scan) = begin(&mut memory, recipe);
        assert_eq!(status, Status::Ok);
        let described = describe(recipe);
        assert_eq!(record_all(scan), usize::from(described.samples));
        let residual = fit(scan);
        assert!(residual.mean > 0.0 && residual.worst >= residual.mean);
        let core_fit = fit_with_core(recipe);
        let expected = &core_fit.values;
        assert_eq!(expected.len(), usize::from(described.values));
        let mut again = glimpse_residual::default();
        let mut values = vec![f32::NAN; expected.len() + 1];
        let (pointer, mut count) = (values.as_mut_ptr(), 0);
        unsafe {
            let status = glimpse_fitted_residual(scan, &raw mut again);
            assert_eq!(status, Status::Ok);
            let status = glimpse_fitted_values(scan, pointer, expected.len() - 1, &raw mut count);
            assert_eq!((status, count), (Status::BufferTooSmall, expected.len()));
            assert!(values.iter().all(|value| value.is_nan()));
            let status = glimpse_fitted_values(scan, pointer, expected.len(), &raw mut count);
            assert_eq!(status, Status::Ok);
        }
        assert_eq!(again, residual);
        assert_errors_match(scan, &core_fit);
        predicted_count += usize::from(core_fit.predicted_loss.is_some());
        assert!(values.pop().unwrap().is_nan());
        let bits: vec::Vec<u32> = values.iter().map(|value| value.to_bits()).collect();
        assert_eq!(&bits, expected);

        let mut brdf = [0.0; 3];
        let status = unsafe { glimpse_fitted_brdf(scan, &raw const MIRROR, &raw mut brdf) };
        if described.model == glimpse_model::Linear {
            assert_eq!(status, Status::NoBasis);
        } else {
            assert_eq!(status, Status::Ok);
            assert!(brdf.iter().all(|value| value.is_finite() && *value >= 0.0));
        }
    }
    assert!(predicted_count > 0 && predicted_count < RECIPES.len());
}

/// Returns a recipe of Linear with another uncertainty, and with or without its correction. Without it, the similarity to
/// the training is unknown.
fn with_uncertainty(recipe: &[u8], max_innovation: f32, is_corrected: bool) -> Vec<u8> {
    let recipe = Recipe::parse(recipe).unwrap();
    let pattern: Vec<u8> = recipe
        .pattern()
        .flat_map(|angles| [angles.theta_h, angles.theta_d, angles.phi_d])
        .flat_map(f32::to_le_bytes)
        .collect();
    let mut method = recipe.method().into();
    let PackedMethod::Completed(net, correction, _) = &mut method else {
        panic!("the recipe has no completion");
    };
    if !is_corrected {
        // Without a correction, the net has the components at the samples.
        let PackedCorrection {
            rows, row_scales, ..
        } = correction.take().expect("a correction");
        (net.rows, net.row_scales) = (rows, row_scales);
    }
    let prediction = recipe.completed().unwrap().prediction();
    let parts = RecipeParts {
        prediction: Some(prediction.words().as_flattened()),
        uncertainty: Some(Uncertainty {
            innovation: 0.5,
            residual: 0.25,
            bound: 2.0,
            max_innovation,
        }),
        ..RecipeParts::new(&pattern, method)
    };
    let mut buffer = vec![0; 1 << 16];
    Recipe::write(&parts, &mut buffer).unwrap().to_vec()
}

#[test]
fn bound_and_similarity_to_training_match_core() {
    let mut memory = AlignedMemory::for_scan();
    let [.., linear] = RECIPES;
    for (max_innovation, is_corrected, expected) in [
        (1.0, false, None),
        (1e-6, true, Some(true)),
        (1e6, true, Some(false)),
    ] {
        let recipe = with_uncertainty(linear, max_innovation, is_corrected);
        let (status, scan) = begin(&mut memory, &recipe);
        assert_eq!(status, Status::Ok);
        assert_eq!(record_all(scan), 8);
        fit(scan);
        let core_fit = fit_with_core(&recipe);
        assert_eq!(core_fit.is_unlike_training, expected);
        assert!(core_fit.loss_bound > core_fit.predicted_loss);
        assert_errors_match(scan, &core_fit);
    }
}

#[test]
fn readings_in_any_order_replace_earlier_ones() {
    let mut memory = AlignedMemory::for_scan();
    let (_, scan) = begin(&mut memory, RECIPES[0]);
    let mut recorded = glimpse_recorded::default();
    let mut found = glimpse_reading::default();
    let mut sample = glimpse_sample::default();
    let first = reading(5);
    let second = glimpse_reading {
        brdf: [-0.9; 3],
        saturated: 77,
    };
    let read = |found: &mut glimpse_reading| unsafe { glimpse_scan_reading(scan, 5, found) };
    unsafe {
        assert_eq!(read(&mut found), Status::NotRead);
        for (reading, replaced, clamped) in [(&first, 0, 0), (&second, 1, 1)] {
            let status = glimpse_scan_record(scan, 5, reading, &raw mut recorded);
            assert_eq!(status, Status::Ok);
            assert_eq!(recorded, glimpse_recorded { replaced, clamped });
        }
        assert_eq!(read(&mut found), Status::Ok);
        assert_eq!((found.brdf, found.saturated), (second.brdf, 1));

        // Sample 5 is no longer pending.
        for (from, index) in [(0, 0), (5, 6), (7, 7)] {
            assert_eq!(glimpse_scan_next(scan, from, &raw mut sample), Status::Ok);
            assert_eq!(sample.index, index);
        }
        let status = glimpse_scan_next(scan, 8, &raw mut sample);
        assert_eq!(status, Status::NonePending);
        assert_eq!(glimpse_scan_restart(scan), Status::Ok);
        assert_eq!(read(&mut found), Status::NotRead);
    }
}

#[test]
fn arm_angles_match_directions() {
    let mut memory = AlignedMemory::for_scan();
    let (_, scan) = begin(&mut memory, RECIPES[2]);
    let mut sample = glimpse_sample::default();
    for index in 0..8 {
        let status = unsafe { glimpse_scan_next(scan, index, &raw mut sample) };
        assert_eq!((status, sample.index), (Status::Ok, index));
        let again = glimpse_directions_of(sample.arms);
        let pairs = [
            (again.incoming, sample.directions.incoming),
            (again.outgoing, sample.directions.outgoing),
        ];
        for (found, expected) in pairs {
            for (found, expected) in found.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-6);
            }
        }
    }
}

/// A call in a wrong state has its own status, and changes nothing.
#[test]
fn rejects_wrong_order_of_calls() {
    let mut memory = AlignedMemory::for_scan();
    let (_, scan) = begin(&mut memory, RECIPES[1]);
    let mut residual = glimpse_residual::default();
    let mut brdf = [0.0; 3];
    let mut count = 0;
    let (mut loss, mut unlike) = (0.0, glimpse_answer::No);
    unsafe {
        let mut assert_not_fitted = || {
            let found = [
                glimpse_fitted_residual(scan, &raw mut residual),
                glimpse_fitted_brdf(scan, &raw const MIRROR, &raw mut brdf),
                glimpse_fitted_values(scan, null_mut(), 0, &raw mut count),
                glimpse_fitted_predicted_loss(scan, &raw mut loss),
                glimpse_fitted_loss_bound(scan, &raw mut loss),
                glimpse_fitted_is_unlike_training(scan, &raw mut unlike),
            ];
            assert_eq!(found, [Status::NotFitted; 6]);
        };
        assert_not_fitted();
        assert_eq!(glimpse_fit_begin(scan), Status::Incomplete);
        assert_eq!(glimpse_fit_advance(scan, 8, null_mut()), Status::NoFit);
        assert_eq!(glimpse_fit_finish(scan, null_mut()), Status::NoFit);
        assert_eq!(record_all(scan), 8);
        assert_eq!(glimpse_fit_advance(scan, 8, null_mut()), Status::NoFit);
        assert_eq!(glimpse_fit_begin(scan), Status::Ok);
        assert_eq!(glimpse_fit_finish(scan, null_mut()), Status::Unfinished);
        assert_not_fitted();
        // A new reading ends the fit.
        let reading = reading(3);
        let status = glimpse_scan_record(scan, 3, &raw const reading, null_mut());
        assert_eq!(status, Status::Ok);
        assert_eq!(glimpse_fit_advance(scan, 8, null_mut()), Status::NoFit);
        assert_eq!(glimpse_fit_begin(scan), Status::Ok);
        let status = glimpse_fit_advance(scan, u32::MAX, null_mut());
        assert_eq!(status, Status::Ok);
        assert_not_fitted();
        assert_eq!(glimpse_fit_finish(scan, null_mut()), Status::Ok);
        assert_eq!(glimpse_fit_finish(scan, null_mut()), Status::NoFit);
        let below = crate::types::glimpse_directions {
            outgoing: [0.6, 0.0, -0.8],
            incoming: MIRROR.incoming,
        };
        let status = glimpse_fitted_brdf(scan, &raw const below, &raw mut brdf);
        assert_eq!(status, Status::Directions);
        let status = glimpse_fitted_values(scan, null_mut(), 0, &raw mut count);
        assert_eq!((status, count), (Status::BufferTooSmall, 8));
        assert_eq!(glimpse_scan_restart(scan), Status::Ok);
        let status = glimpse_fitted_brdf(scan, null(), &raw mut brdf);
        assert_eq!(status, Status::Null);
    }
}

#[test]
fn rejects_invalid_readings() {
    let mut memory = AlignedMemory::for_scan();
    let (_, scan) = begin(&mut memory, RECIPES[0]);
    let record = |index, brdf| {
        let reading = glimpse_reading { brdf, saturated: 0 };
        unsafe { glimpse_scan_record(scan, index, &raw const reading, null_mut()) }
    };
    assert_eq!(record(0, [f32::NAN; 3]), Status::ReadingNonFinite);
    assert_eq!(record(0, [0.1, -2.0, 0.1]), Status::ReadingNegative);
    assert_eq!(record(8, [0.1; 3]), Status::ReadingIndex);
    // A sensor's raw counts.
    for index in 0..8 {
        assert_eq!(record(index, [1000.0 + f32::from(index); 3]), Status::Ok);
    }
    assert_eq!(unsafe { glimpse_fit_begin(scan) }, Status::TooLarge);
}
