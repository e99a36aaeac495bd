//! A recipe from untrusted bytes: it is rejected, or a scan with it stays within its memory and gives finite numbers.
//!
//! An input contains a byte and a recipe. If the byte is odd, the header is corrected before the recipe is parsed,
//! because random bytes almost never have the right checksum and sizes.

use glimpse_core::error::ErrorCode;
use glimpse_core::file::HEADER_BYTES;
use glimpse_core::fit::{AnyModel, Linear, ScanModel};
use glimpse_core::geometry::Directions;
use glimpse_core::gonio::Reading;
use glimpse_core::model::{CookTorrance, Neural, Phong};
use glimpse_core::recipe::{Contents, FORMAT, Recipe, SECTIONS_START, memory_words};
use glimpse_core::scan::Scan;

/// The largest number of samples of a fit in this check.
const MAX_SAMPLES: usize = 64;
/// The largest number of units of work of a fit.
const MAX_UNITS: u32 = 2_000;

/// Checks one input.
pub fn check(bytes: &[u8]) {
    let Some((correct_header, bytes)) = bytes.split_first() else {
        return;
    };
    let mut bytes = bytes.to_vec();
    if correct_header & 1 == 1 && bytes.len() >= SECTIONS_START {
        correct(&mut bytes);
    }
    let Ok(recipe) = Recipe::parse(&bytes) else {
        return;
    };
    assert_eq!(memory_words(&[&bytes]), recipe.memory_words());
    assert_eq!(recipe.pattern().count(), recipe.samples());
    assert!(recipe.expected_loss().is_none_or(f32::is_finite));
    check_scan::<Phong>(recipe);
    check_scan::<CookTorrance>(recipe);
    check_scan::<Neural>(recipe);
    check_scan::<Linear>(recipe);
    check_scan::<AnyModel>(recipe);
}

/// Corrects the sizes and the checksum in a header.
fn correct(bytes: &mut [u8]) {
    let contents = Contents::decode(&bytes[SECTIONS_START..]);
    if let Ok((pattern, estimator)) = contents.and_then(|contents| contents.check()) {
        let samples = pattern.directions.len() / 3;
        let words = estimator.scan_words(samples) as u32;
        bytes[14..16].copy_from_slice(&(samples as u16).to_le_bytes());
        bytes[16..20].copy_from_slice(&words.to_le_bytes());
    }
    let header = FORMAT.header(&bytes[HEADER_BYTES..]);
    bytes[6..HEADER_BYTES].copy_from_slice(&header[6..]);
}

/// Checks two fits. The first has one reading, if the recipe tolerates missing readings. The second has all readings,
/// half of them saturated.
fn check_scan<K: ScanModel>(recipe: Recipe<'_>) {
    if recipe.samples() > MAX_SAMPLES {
        return; // the fit would take too long
    }
    let mut memory = vec![f32::NAN; recipe.memory_words()];
    let Ok(mut scan) = Scan::<K>::new(recipe, &mut memory) else {
        return;
    };
    let samples = recipe.samples() as u16;
    let reading = Reading::new([0.4, 0.3, 0.2]);
    scan.record(samples / 2, reading).expect("a valid reading");
    let one_is_enough = samples == 1 || recipe.tolerates_missing();
    assert_eq!(scan.fit().is_ok(), one_is_enough);
    if one_is_enough {
        check_fit(&mut scan);
    }
    for index in 0..samples {
        let saturated = index % 2 == 1;
        let reading = Reading {
            brdf: [0.4, 0.3, 0.2 + 0.01 * f32::from(index)],
            saturated,
        };
        scan.record(index, reading).expect("a valid reading");
    }
    check_fit(&mut scan);
}

/// Checks that the values of a finished fit are finite.
fn check_fit<K: ScanModel>(scan: &mut Scan<'_, K>) {
    let mut fit = scan.fit().expect("all required readings");
    let is_complete = fit.advance(MAX_UNITS).is_complete();
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
            let residual = fitted.residual();
            assert!(residual.mean.is_finite() && residual.worst.is_finite());
            let estimates = [fitted.predicted_loss(), fitted.loss_bound()];
            assert!(estimates.into_iter().flatten().all(f32::is_finite));
            let mirror = Directions {
                incoming: [0.6, 0.0, 0.8],
                outgoing: [-0.6, 0.0, 0.8],
            };
            assert!(
                fitted
                    .brdf(&mirror)
                    .is_none_or(|brdf| brdf.iter().all(|x| x.is_finite()))
            );
        }
    }
}
