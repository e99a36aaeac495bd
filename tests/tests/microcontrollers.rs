//! Every model on every kind of microcontroller: the host's numbers, within the budgets.

use glimpse_core::fit::Fitter;
use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::loss::cosine_weighted_log_error;
use glimpse_core::model::{CookTorrance, ModelKind, Neural, Phong};
use glimpse_core::recipe::Recipe;
use glimpse_fits::{Linear, measure, recipes};
use glimpse_tests::budgets::Budgets;
use glimpse_tests::figures::{MODELS, figures};
use glimpse_tests::microcontroller::{Binary, Functions, TARGETS};
use glimpse_trainer::evaluation::scan;

/// The recipe that is fitted by.
fn recipe(model: ModelKind) -> Recipe<'static> {
    Recipe::parse(match model {
        ModelKind::Phong => recipes::PHONG,
        ModelKind::CookTorrance => recipes::COOK_TORRANCE,
        ModelKind::Neural => recipes::NEURAL,
        ModelKind::Linear => recipes::LINEAR,
    })
    .unwrap()
}

/// What the host makes of the same readings: parameters or coefficients.
fn host(model: ModelKind) -> Vec<f32> {
    let found = scan(&recipe(model), &mut |angles| measure(angles).brdf);
    found.unwrap().values
}

/// The mean residual before the fit; of Linear, of the mean material.
fn unexplained(model: ModelKind) -> f32 {
    match model {
        ModelKind::Phong => at_the_start::<Phong>(model),
        ModelKind::CookTorrance => at_the_start::<CookTorrance>(model),
        ModelKind::Neural => at_the_start::<Neural>(model),
        ModelKind::Linear => at_the_start::<Linear>(model),
    }
}

fn at_the_start<K: Fitter>(model: ModelKind) -> f32 {
    let recipe = recipe(model);
    let learner = recipe.learner();
    let mut workspace = K::EMPTY;
    K::start(&mut workspace, &learner);
    let errors = recipe.pattern().enumerate().map(|(index, angles)| {
        let at = HalfDifference::from_angles(angles);
        let modelled = K::at_sample(&workspace, &learner, index, &at);
        let measured = measure(angles).brdf;
        let loss = cosine_weighted_log_error(measured, modelled, at.cos_theta_i(), 1.0 / 3.0);
        loss.error.value()
    });
    errors.sum::<f32>() / recipe.samples() as f32
}

/// Floating point in hardware and in software, Arm and RISC-V: they round alike, so a fit ends in
/// the same bits on all of them, and on the host.
#[test]
fn all_targets_agree_with_the_host_bit_for_bit() {
    for model in MODELS {
        let expected = host(model);
        for target in TARGETS {
            let found = Binary::new(target, Functions::Libm, model.name()).run();
            let found = found.numbers("parameters");
            let bits = |list: &[f32]| list.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
            assert_eq!(
                bits(&found),
                bits(&expected),
                "{model} on {}",
                target.triple
            );
        }
    }
}

/// micromath is coarser, and the loss jumps where a sample changes sides, so its fits end elsewhere.
/// They are fits nevertheless: of what the start leaves unexplained they explain a good part.
#[test]
fn fits_with_micromath_explain_the_measurements_too() {
    for model in MODELS {
        let before = unexplained(model);
        let [libm, micromath] = [Functions::Libm, Functions::Micromath].map(|functions| {
            let output = Binary::new(TARGETS[0], functions, model.name()).run();
            output.numbers("residual")[0]
        });
        println!(
            "{model}: mean residual {before:.4}, {libm:.4} by libm, {micromath:.4} by micromath"
        );
        assert!(libm < 0.6 * before && micromath < 0.6 * before);
    }
}

#[test]
fn all_figures_are_within_their_budgets() {
    let budgets = Budgets::load();
    let over = budgets.exceeded(&figures());
    assert!(over.is_empty(), "{}", over.join("\n"));
}
