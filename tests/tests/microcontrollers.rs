//! Every model, by every kind of recipe, on microcontrollers: the host's numbers, within the budgets.

use glimpse_bench::recipes::masked;
use glimpse_bench::{is_lost, measure};
use glimpse_core::fit::{Channels, Fitter, Linear};
use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::loss::cosine_weighted_log_error;
use glimpse_core::model::{CookTorrance, ModelKind, Neural, Phong};
use glimpse_core::recipe::Recipe;
use glimpse_kernels::scan::scan_some;
use glimpse_tests::budgets::Budgets;
use glimpse_tests::figures::{FITS, Fit, demo_figures, figures};
use glimpse_tests::microcontroller::{Binary, Functions, TARGETS};
use glimpse_trainer::evaluation::scan;

/// What the host makes of the same readings: parameters or coefficients.
fn host(recipe: &Recipe<'_>) -> Vec<f32> {
    let found = scan(recipe, &mut |angles| measure(angles).brdf);
    found.unwrap().values
}

/// The mean residual before the fit; of Linear, of the mean material.
fn unexplained(recipe: &Recipe<'_>) -> f32 {
    match recipe.model() {
        ModelKind::Phong => at_the_start::<Phong>(recipe),
        ModelKind::CookTorrance => at_the_start::<CookTorrance>(recipe),
        ModelKind::Neural => at_the_start::<Neural>(recipe),
        _ => at_the_start::<Linear>(recipe),
    }
}

fn at_the_start<K: Fitter>(recipe: &Recipe<'_>) -> f32 {
    let learner = recipe.method();
    let words = K::words(&learner, recipe.samples()).unwrap();
    let mut workspace = vec![0.0; words];
    K::start(&mut workspace, &learner, Channels::Color);
    let errors = recipe.pattern().enumerate().map(|(index, angles)| {
        let at = HalfDifference::from_angles(angles);
        let modeled = K::at_sample(&workspace, &learner, index, &at);
        let measured = measure(angles).brdf;
        let loss = cosine_weighted_log_error(measured, modeled, at.cos_theta_i(), 1.0 / 3.0);
        loss.error.value()
    });
    errors.sum::<f32>() / recipe.samples() as f32
}

/// Floating point in hardware and in software, Arm and RISC-V: they round alike, so a fit ends in
/// the same bits on all of them, and on the host.
#[test]
fn all_targets_agree_with_the_host_bit_for_bit() {
    for fit in FITS {
        let expected = host(&Recipe::parse(fit.recipe).unwrap());
        for target in TARGETS {
            if !fit.is_built(target, Functions::Libm) {
                continue;
            }
            let found = Binary::new(target, Functions::Libm, fit.name).run();
            let found = found.numbers("parameters");
            let bits = |list: &[f32]| list.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
            assert_eq!(
                bits(&found),
                bits(&expected),
                "{} on {}",
                fit.name,
                target.triple
            );
        }
    }
}

/// A recipe that was trained for it fits what there is when every third reading is lost, and ends
/// elsewhere than with all of them.
#[test]
fn the_board_agrees_with_the_host_where_readings_are_lost() {
    for (name, recipe) in [
        ("linear-lost", masked::LINEAR),
        ("neural-lost", masked::NEURAL),
    ] {
        let recipe = Recipe::parse(recipe).unwrap();
        let mut some = |index, angles| (!is_lost(index)).then(|| measure(angles).brdf);
        let expected = scan_some(&recipe, &mut some).unwrap().values;
        let found = Binary::new(TARGETS[0], Functions::Libm, name).run();
        let found = found.numbers("parameters");
        let bits = |list: &[f32]| list.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&found), bits(&expected), "{name}");
        assert_ne!(bits(&found), bits(&host(&recipe)), "{name}");
    }
}

/// micromath is coarser, and the loss jumps where a sample changes sides, so its fits end elsewhere.
/// They are fits nevertheless: of what the start leaves unexplained they explain a good part.
#[test]
fn fits_with_micromath_explain_the_measurements_too() {
    let by_both = |fit: &Fit| fit.is_built(TARGETS[0], Functions::Micromath);
    for Fit { name, recipe, .. } in FITS.into_iter().filter(by_both) {
        let before = unexplained(&Recipe::parse(recipe).unwrap());
        let [libm, micromath] = [Functions::Libm, Functions::Micromath].map(|functions| {
            let output = Binary::new(TARGETS[0], functions, name).run();
            output.numbers("residual")[0]
        });
        println!(
            "{name}: mean residual {before:.4}, {libm:.4} by libm, {micromath:.4} by micromath"
        );
        assert!(libm < 0.6 * before && micromath < 0.6 * before);
    }
}

#[test]
fn all_figures_are_within_their_budgets() {
    let mut figures = figures();
    let over = Budgets::load().exceeded(&figures);
    figures.extend(demo_figures());
    for (name, value) in figures {
        println!("{name}={value}");
    }
    assert!(over.is_empty(), "{}", over.join("\n"));
}
