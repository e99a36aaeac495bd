//! A sensor with one channel gives a gray material, to the bit.

use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::fit::{AnyModel, Linear, ScanModel};
use glimpse_core::model::{CookTorrance, ModelKind, Neural, Phong};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{Reading, Scan};

use super::SCAN_RECIPES;
use crate::completion::contents::CompletedContents;
use crate::recipes::parsed;
use crate::scanning::{MODELS, fit, recipe_for, record};

/// Readings of a glossy gray material, with a highlight at one sample of four.
fn glossy(index: u16) -> Reading {
    let k = f32::from(index);
    let highlight = if index % 4 == 2 { 1.7 } else { 0.0 };
    Reading::monochrome(0.11 + 0.03 * k + highlight)
}

/// Checks that the three channels are equal at the pattern or, for Linear, in the coefficients.
fn assert_gray<K: ScanModel>(recipe: &Recipe<'_>) {
    let mut memory = vec![0.0; recipe.memory_words()];
    let mut scan = Scan::<K>::new(*recipe, &mut memory).unwrap();
    record(&mut scan, 0..recipe.samples() as u16, glossy);
    let values = fit(&mut scan, &[7]).values();
    if recipe.model() == ModelKind::Linear {
        let (channels, rest) = values.as_chunks::<1>();
        let m = channels.len() / 3;
        assert!(rest.is_empty() && channels[..m] == channels[m..2 * m]);
        assert_eq!(channels[..m], channels[2 * m..]);
        return;
    }
    let fitted = scan.fitted().unwrap();
    for (_, directions) in recipe.directions() {
        let [red, green, blue] = fitted.brdf(&directions).unwrap().map(f32::to_bits);
        assert!(red == green && green == blue, "{}", recipe.model());
    }
}

#[test]
fn monochrome_readings_give_gray_material() {
    let synthetic = MODELS.map(recipe_for);
    let completed = CompletedContents::all_small(MissingPolicy::AllRequired);
    let completed: Vec<_> = completed.iter().map(CompletedContents::recipe).collect();
    let trained = SCAN_RECIPES.map(|bytes| parsed(bytes.to_vec()));
    for recipe in synthetic.iter().chain(&completed).chain(&trained) {
        match recipe.model() {
            ModelKind::Phong => assert_gray::<Phong>(recipe),
            ModelKind::CookTorrance => assert_gray::<CookTorrance>(recipe),
            ModelKind::Neural => assert_gray::<Neural>(recipe),
            _ => assert_gray::<Linear>(recipe),
        }
        assert_gray::<AnyModel>(recipe);
    }
}

/// A single colored reading is enough for a colored material.
#[test]
fn one_colored_reading_gives_colored_material() {
    for recipe in MODELS.map(recipe_for) {
        let mut memory = vec![0.0; recipe.memory_words()];
        let mut scan = Scan::<AnyModel>::new(recipe, &mut memory).unwrap();
        record(&mut scan, 0..8, glossy);
        record(&mut scan, [5], |_| Reading::monochrome(0.2));
        let gray = fit(&mut scan, &[7]).values();
        for channel in 0..3 {
            let mut brdf = [0.2; 3];
            brdf[channel] = 0.3;
            scan.record(5, Reading::new(brdf)).unwrap();
            assert_ne!(fit(&mut scan, &[7]).values(), gray);
        }
    }
}
