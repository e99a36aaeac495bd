//! A recipe from bytes that nobody vouches for: it is refused, or all that it promises holds.
//!
//! Random bytes never have the right checksum, so one input in two has it put right first.

use crc::{CRC_32_ISO_HDLC, Crc};
use glimpse_core::fit::{Fitter, Linear, MAX_ROWS, MAX_UNITS, Target};
use glimpse_core::model::{CookTorrance, Neural, Phong};
use glimpse_core::recipe::{
    Completed, FitMethod, HEADER_BYTES, Kind, Recipe, VERSION, memory_words,
};
use glimpse_core::scan::{FinishError, Reading, Scan};

/// The largest number of samples that is fitted.
const CAPACITY: usize = 64;

/// Checks one input.
pub fn check(bytes: &[u8]) {
    let Some((mend, bytes)) = bytes.split_first() else {
        return;
    };
    let mut bytes = bytes.to_vec();
    if mend & 1 == 1 && bytes.len() >= HEADER_BYTES {
        let length = (bytes.len() - HEADER_BYTES) as u32;
        bytes[6..10].copy_from_slice(&length.to_le_bytes());
        let covered = [&bytes[4..10], &bytes[HEADER_BYTES..]].concat();
        let checksum = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&covered);
        bytes[10..14].copy_from_slice(&checksum.to_le_bytes());
    }
    let Ok(recipe) = Recipe::parse(&bytes) else {
        return;
    };
    look(&recipe);
    copy(&recipe, &bytes);
    let budget = match recipe.method() {
        FitMethod::Descent(_) => 64,
        FitMethod::Ridge(_) => u32::MAX,
        // A completion's own units, and some steps.
        FitMethod::Completed(_) => 256,
    };
    assert_eq!(memory_words(&[&bytes]), recipe.memory_words());
    scan::<Phong>(recipe, budget);
    scan::<CookTorrance>(recipe, budget);
    scan::<Neural>(recipe, budget);
    scan::<Linear>(recipe, budget);
}

/// All that a recipe says of itself.
fn look(recipe: &Recipe<'_>) {
    assert_eq!(recipe.pattern().count(), recipe.samples());
    let directions = recipe.directions().map(|(index, _)| usize::from(index));
    assert!(directions.eq(0..recipe.samples()));
    assert!(recipe.expected_loss().is_none_or(f32::is_finite));
    let Ok(statements) = recipe.metadata() else {
        return;
    };
    if let Some(limits) = statements.limits {
        let angles = [
            limits.max_theta_i,
            limits.max_theta_o,
            limits.min_separation,
        ];
        assert!(angles.iter().all(|angle| *angle >= 0.0 && *angle < 3.2));
    }
    if let Some(noise) = statements.noise {
        assert!(noise.multiplicative >= 0.0 && noise.additive >= 0.0);
    }
    if let Some(expectation) = statements.expectation {
        assert_eq!(recipe.expected_loss(), Some(expectation.loss));
        assert!(expectation.loss.is_finite());
        assert!(expectation.standard_error.is_none_or(|error| error >= 0.0));
    }
    if let Some(provenance) = statements.provenance {
        assert!(provenance.trainer.len() + provenance.options.len() < 1 << 20);
    }
    if let Some(training) = statements.training {
        let sources = training.sources;
        assert_eq!(sources.count(), sources.len());
        let mut sources = sources;
        assert!(sources.all(|source| (0.0..=1.0).contains(&source.share)));
    }
    let materials = statements.materials;
    assert_eq!(materials.count(), materials.len());
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
        FitMethod::Completed(completed) => look_at_completed(recipe, &completed),
    }
}

/// A completion has the shape that its counts say.
fn look_at_completed(recipe: &Recipe<'_>, completed: &Completed<'_>) {
    let (samples, completion) = (recipe.samples(), completed.coefficient_net());
    let (components, rows) = (completion.components, completion.rows());
    assert!((1..=MAX_ROWS).contains(&rows) && (1..=rows).contains(&components));
    assert_eq!(completion.readings.len(), samples * 3 * rows);
    assert_eq!(completion.output.len(), components * completion.hidden());
    assert_eq!(completed.center().len(), samples);
    assert!(completed.scale() > 0.0);
    assert_eq!(completed.model(), recipe.model());
    match completed.target() {
        Target::Linear(linear) => {
            assert_eq!(linear.rows().len(), samples * components);
            assert_eq!(linear.basis_checksum(), recipe.method().basis_checksum());
        }
        Target::Descent(descent, start) => {
            assert_eq!(Some(descent.initial().len()), descent.model().parameters());
            assert!((1..=MAX_UNITS).contains(&start.units()));
            assert_eq!(start.output.len(), descent.initial().len() * start.units());
        }
    }
}

/// A copy says the same, and a copy without the optional sections nothing but the rest.
fn copy(recipe: &Recipe<'_>, bytes: &[u8]) {
    let mut buffer = vec![0; bytes.len()];
    let whole = recipe.copy_without(&[], &mut buffer).expect("it fits");
    let copy = Recipe::parse(whole).expect("a copy is a recipe");
    assert_eq!(whole[4..6], VERSION.to_le_bytes());
    let said = |recipe: &Recipe<'_>| format!("{:?}", recipe.metadata());
    assert_eq!(said(&copy), said(recipe));
    same_numbers(&copy, recipe);
    assert!(copy.sections().eq(recipe.sections()));

    let optional: Vec<Kind> = copy.sections().map(|(kind, _)| kind).collect();
    let optional: Vec<Kind> = optional
        .into_iter()
        .filter(|kind| !kind.is_required())
        .collect();
    let mut buffer = vec![0; bytes.len()];
    let bare = recipe
        .copy_without(&optional, &mut buffer)
        .expect("it fits");
    let bare = Recipe::parse(bare).expect("a copy is a recipe");
    let required = copy.sections().count() - optional.len();
    assert_eq!(bare.sections().count(), required);
    let companions = match recipe.method() {
        FitMethod::Completed(completed) if matches!(completed.target(), Target::Descent(..)) => 3,
        _ => 1,
    };
    assert_eq!(required, 1 + companions);
    same_numbers(&bare, recipe);
}

/// Pattern and method, to the bit.
fn same_numbers(a: &Recipe<'_>, b: &Recipe<'_>) {
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
            // All numbers of it, as they are packed.
            assert_eq!(format!("{a:?}"), format!("{b:?}"));
        }
        _ => panic!("a copy has another method"),
    }
}

/// Reads and fits for a while: everything, and where the recipe can do without some of the readings
/// one of them, and all but the saturated ones. What comes of a fit, if it ends, is finite.
fn scan<K: Fitter>(recipe: Recipe<'_>, budget: u32) {
    if recipe.samples() > CAPACITY {
        return; // it would take too long
    }
    let mut memory = vec![0.0; recipe.memory_words()];
    let Ok(mut scan) = Scan::<K>::new(recipe, &mut memory) else {
        return;
    };
    let samples = recipe.samples() as u16;
    let reading = Reading::new([0.4, 0.3, 0.2]);
    scan.record(samples / 2, reading)
        .expect("a BRDF is a reading");
    let is_enough = samples == 1 || recipe.tolerates_missing();
    assert_eq!(scan.fit().is_ok(), is_enough);
    if is_enough {
        fit(&mut scan, budget);
    }
    for index in 0..samples {
        let saturated = index % 2 == 1;
        let reading = Reading {
            saturated,
            ..reading
        };
        scan.record(index, reading).expect("a BRDF is a reading");
    }
    fit(&mut scan, budget);
}

fn fit<K: Fitter>(scan: &mut Scan<'_, K>, budget: u32) {
    let mut fit = scan.fit().expect("all that is needed is read");
    let is_complete = fit.advance(budget).is_complete();
    match fit.finish() {
        Ok(_) | Err(FinishError::Implausible(_)) => {
            let fitted = scan.fitted().expect("it is finished");
            assert!(fitted.values().all(f32::is_finite));
            assert!(fitted.residual().mean.is_finite());
        }
        Err(FinishError::Unfinished(_)) => assert!(!is_complete),
        Err(error) => assert!(is_complete && error == FinishError::Diverged),
    }
}
