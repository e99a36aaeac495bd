//! Every model on every kind of microcontroller: the host's numbers, within the budgets.

use glimpse_core::fit::Workspace;
use glimpse_core::model::{CookTorrance, Model, ModelKind, Neural, ParameterSet, Phong};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::{LinearScan, Scan};
use glimpse_fits::{LINEAR_MEMORY, SAMPLES, measure, recipes};
use glimpse_tests::budgets::Budgets;
use glimpse_tests::figures::{MODELS, figures};
use glimpse_tests::microcontroller::{Binary, Functions, TARGETS};

/// What the host makes of the same measurements: parameters or coefficients.
fn host(model: ModelKind) -> Vec<f32> {
    match model {
        ModelKind::Phong => descend::<Phong>(recipes::PHONG),
        ModelKind::CookTorrance => descend::<CookTorrance>(recipes::COOK_TORRANCE),
        ModelKind::Neural => descend::<Neural>(recipes::NEURAL),
        ModelKind::Linear => solve(),
    }
}

fn descend<M: Model>(recipe: &[u8]) -> Vec<f32> {
    let recipe = Recipe::parse(recipe).unwrap();
    let mut workspace = Workspace::<M>::new();
    let mut scan = Scan::<M, SAMPLES>::new(recipe, &mut workspace).unwrap();
    for angles in recipe.pattern() {
        scan.record(measure(angles)).unwrap();
    }
    while !scan.advance_fit(usize::MAX).is_complete() {}
    scan.parameters().iter().copied().collect()
}

fn solve() -> Vec<f32> {
    let recipe = Recipe::parse(recipes::LINEAR).unwrap();
    let mut memory = [0.0; LINEAR_MEMORY];
    let mut scan = LinearScan::<SAMPLES>::new(recipe, &mut memory).unwrap();
    for angles in recipe.pattern() {
        scan.record(measure(angles)).unwrap();
    }
    while !scan.advance_fit(usize::MAX).is_complete() {}
    scan.coefficients().to_vec()
}

/// The mean residual before the fit; of Linear, of the mean material.
fn unexplained(model: ModelKind) -> f32 {
    match model {
        ModelKind::Phong => at_the_start::<Phong>(recipes::PHONG),
        ModelKind::CookTorrance => at_the_start::<CookTorrance>(recipes::COOK_TORRANCE),
        ModelKind::Neural => at_the_start::<Neural>(recipes::NEURAL),
        ModelKind::Linear => {
            let recipe = Recipe::parse(recipes::LINEAR).unwrap();
            let mut memory = [0.0; LINEAR_MEMORY];
            let mut scan = LinearScan::<SAMPLES>::new(recipe, &mut memory).unwrap();
            for angles in recipe.pattern() {
                scan.record(measure(angles)).unwrap();
            }
            scan.residual().mean
        }
    }
}

fn at_the_start<M: Model>(recipe: &[u8]) -> f32 {
    let recipe = Recipe::parse(recipe).unwrap();
    let mut workspace = Workspace::<M>::new();
    let mut scan = Scan::<M, SAMPLES>::new(recipe, &mut workspace).unwrap();
    for angles in recipe.pattern() {
        scan.record(measure(angles)).unwrap();
    }
    scan.residual().mean
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
