//! A recipe from untrusted bytes: it is rejected, or all its invariants hold.
//!
//! An input contains a byte and a recipe. If the byte is odd, length and checksum of the recipe are corrected before it
//! is parsed, because random bytes almost never have the right checksum.

use crc::{CRC_32_ISO_HDLC, Crc};
use glimpse_core::error::ErrorCode;
use glimpse_core::fit::{Linear, MAX_ROWS, MAX_UNITS, ScanModel, Target};
use glimpse_core::model::{CookTorrance, Neural, Phong};
use glimpse_core::recipe::{
    Completed, FitMethod, HEADER_BYTES, Kind, Recipe, VERSION, memory_words,
};
use glimpse_core::scan::{Reading, Scan};

/// The largest number of samples of a fit in this check.
const MAX_SAMPLES: usize = 64;

/// Checks one input.
pub fn check(bytes: &[u8]) {
    let Some((correct_header, bytes)) = bytes.split_first() else {
        return;
    };
    let mut bytes = bytes.to_vec();
    if correct_header & 1 == 1 && bytes.len() >= HEADER_BYTES {
        let length = (bytes.len() - HEADER_BYTES) as u32;
        bytes[6..10].copy_from_slice(&length.to_le_bytes());
        let checksummed = [&bytes[4..10], &bytes[HEADER_BYTES..]].concat();
        let checksum = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&checksummed);
        bytes[10..14].copy_from_slice(&checksum.to_le_bytes());
    }
    let Ok(recipe) = Recipe::parse(&bytes) else {
        return;
    };
    check_metadata(&recipe);
    check_copies(&recipe, &bytes);
    let max_steps = match recipe.method() {
        FitMethod::Descent(_) => 64,
        FitMethod::Ridge(_) => u32::MAX,
        // Enough for the hidden units of the completion, and for some steps of a descent.
        FitMethod::Completed(_) => 256,
    };
    assert_eq!(memory_words(&[&bytes]), recipe.memory_words());
    check_scan::<Phong>(recipe, max_steps);
    check_scan::<CookTorrance>(recipe, max_steps);
    check_scan::<Neural>(recipe, max_steps);
    check_scan::<Linear>(recipe, max_steps);
}

/// Checks the metadata, the sections and the method of a recipe.
fn check_metadata(recipe: &Recipe<'_>) {
    assert_eq!(recipe.pattern().count(), recipe.samples());
    let directions = recipe.directions().map(|(index, _)| usize::from(index));
    assert!(directions.eq(0..recipe.samples()));
    assert!(recipe.expected_loss().is_none_or(f32::is_finite));
    let kinds: Vec<Kind> = recipe.sections().map(|(kind, _)| kind).collect();
    assert!(kinds.is_sorted_by(|a, b| a < b));
    match recipe.method() {
        FitMethod::Descent(descent) => {
            assert_eq!(Some(descent.initial().len()), descent.model().parameters());
            assert_eq!(descent.step_sizes().len(), descent.initial().len());
        }
        FitMethod::Ridge(ridge) => {
            let entries = recipe.samples() * ridge.components();
            assert_eq!(ridge.basis().len(), entries);
        }
        FitMethod::Completed(completed) => check_completed(recipe, &completed),
    }
}

/// Checks that the arrays of a completion have the lengths that its counts imply.
fn check_completed(recipe: &Recipe<'_>, completed: &Completed<'_>) {
    let (samples, completion) = (recipe.samples(), completed.coefficient_net());
    let (components, rows) = (completion.components, completion.rows());
    assert!((1..=MAX_ROWS).contains(&rows) && (1..=rows).contains(&components));
    assert_eq!(completion.readings.len(), samples * 3 * rows);
    assert_eq!(completion.output.len(), components * completion.hidden());
    assert_eq!(completed.center().len(), samples);
    assert!(completed.scale() > 0.0);
    assert_eq!(completed.model(), recipe.model());
    let corrected = completed.components();
    if let Some(correction) = completed.correction() {
        assert!(corrected >= components && correction.components() == corrected);
        assert_eq!(correction.at_samples().rows().len(), samples * corrected);
        assert_eq!(correction.at_samples().scales().len(), corrected);
    }
    if let Some(at_samples) = completed.at_samples() {
        assert_eq!(at_samples.rows().len(), samples * corrected);
    }
    match completed.target() {
        Target::Linear(linear) => {
            assert_eq!(linear.basis_checksum(), recipe.method().basis_checksum());
        }
        Target::Descent(descent, start) => {
            assert_eq!(Some(descent.initial().len()), descent.model().parameters());
            assert!((1..=MAX_UNITS).contains(&start.units()));
            assert_eq!(start.output.len(), descent.initial().len() * start.units());
        }
        Target::GaussNewton(steps, start) => {
            assert_eq!(Some(steps.initial().len()), steps.model().parameters());
            assert!((1..=MAX_UNITS).contains(&start.units()));
            assert_eq!(start.hidden.len(), 3 * corrected * start.units());
            assert_eq!(start.output.len(), steps.initial().len() * start.units());
            let readings = steps.virtual_readings();
            assert_eq!(readings.center().len(), readings.len());
            assert_eq!(
                readings.components().rows().len(),
                readings.len() * corrected
            );
            assert!(steps.reading_weight() > 0.0 && steps.error_scale() > 0.0);
        }
    }
}

/// Checks that a copy equals the recipe, and that a copy without the optional sections has only the required ones.
fn check_copies(recipe: &Recipe<'_>, bytes: &[u8]) {
    let mut buffer = vec![0; bytes.len()];
    let copy = recipe
        .copy_without(&[], &mut buffer)
        .expect("the copy fits");
    assert_eq!(copy[4..6], VERSION.to_le_bytes());
    let copy = Recipe::parse(copy).expect("a copy is a recipe");
    assert_eq!(copy.metadata(), recipe.metadata());
    assert_same_numbers(&copy, recipe);
    assert!(copy.sections().eq(recipe.sections()));

    let kinds = copy.sections().map(|(kind, _)| kind);
    let optional: Vec<Kind> = kinds.filter(|kind| !kind.is_required()).collect();
    let mut buffer = vec![0; bytes.len()];
    let reduced = recipe
        .copy_without(&optional, &mut buffer)
        .expect("the copy fits");
    let reduced = Recipe::parse(reduced).expect("a copy is a recipe");
    let required = copy.sections().count() - optional.len();
    assert_eq!(reduced.sections().count(), required);
    let method_sections = match recipe.method() {
        FitMethod::Completed(completed) => {
            let target = match completed.target() {
                Target::Linear(_) => 0,
                Target::Descent(..) | Target::GaussNewton(..) => 2,
            };
            1 + target + usize::from(completed.correction().is_some())
        }
        _ => 1,
    };
    // The pattern has one section.
    assert_eq!(required, 1 + method_sections);
    assert_same_numbers(&reduced, recipe);
}

/// Checks that pattern and method of two recipes are equal, bit for bit.
fn assert_same_numbers(a: &Recipe<'_>, b: &Recipe<'_>) {
    let bits = |recipe: &Recipe<'_>| -> Vec<u32> {
        let angles = recipe.pattern();
        let pattern = angles.flat_map(|angles| [angles.theta_h, angles.theta_d, angles.phi_d]);
        pattern.map(f32::to_bits).collect()
    };
    assert_eq!(bits(a), bits(b));
    match (a.method(), b.method()) {
        (FitMethod::Descent(a), FitMethod::Descent(b)) => {
            assert_eq!((a.model(), a.inner_steps()), (b.model(), b.inner_steps()));
            assert_eq!((a.initial(), a.step_sizes()), (b.initial(), b.step_sizes()));
        }
        (FitMethod::Ridge(a), FitMethod::Ridge(b)) => {
            assert_eq!((a.basis(), a.precision()), (b.basis(), b.precision()));
            assert_eq!((a.mean(), a.median()), (b.mean(), b.median()));
            assert_eq!(
                (a.weight(), a.basis_checksum()),
                (b.weight(), b.basis_checksum())
            );
        }
        (FitMethod::Completed(a), FitMethod::Completed(b)) => {
            // The debug format contains all packed numbers.
            assert_eq!(format!("{a:?}"), format!("{b:?}"));
        }
        _ => panic!("the methods differ"),
    }
}

/// Checks fits of at most `max_steps` steps. The first fit has one reading, if the recipe tolerates missing readings.
/// The second fit has all readings, half of them saturated.
fn check_scan<K: ScanModel>(recipe: Recipe<'_>, max_steps: u32) {
    if recipe.samples() > MAX_SAMPLES {
        return; // the fit would take too long
    }
    let mut memory = vec![0.0; recipe.memory_words()];
    let Ok(mut scan) = Scan::<K>::new(recipe, &mut memory) else {
        return;
    };
    let samples = recipe.samples() as u16;
    let reading = Reading::new([0.4, 0.3, 0.2]);
    scan.record(samples / 2, reading).expect("a valid reading");
    let one_is_enough = samples == 1 || recipe.tolerates_missing();
    assert_eq!(scan.fit().is_ok(), one_is_enough);
    if one_is_enough {
        check_fit(&mut scan, max_steps);
    }
    for index in 0..samples {
        let saturated = index % 2 == 1;
        let reading = Reading {
            saturated,
            ..reading
        };
        scan.record(index, reading).expect("a valid reading");
    }
    check_fit(&mut scan, max_steps);
}

/// Fits for at most `max_steps` steps. Checks that the values of a finished fit are finite.
fn check_fit<K: ScanModel>(scan: &mut Scan<'_, K>, max_steps: u32) {
    let mut fit = scan.fit().expect("all required readings");
    let is_complete = fit.advance(max_steps).is_complete();
    match fit.finish() {
        Err(error) if !error.is_implausible() => {
            let code = match is_complete {
                true => ErrorCode::Diverged,
                false => ErrorCode::Unfinished,
            };
            assert_eq!(error.code, code);
        }
        _ => {
            let fitted = scan.fitted().expect("the fit is finished");
            assert!(fitted.values().all(f32::is_finite));
            assert!(fitted.residual().mean.is_finite());
        }
    }
}
