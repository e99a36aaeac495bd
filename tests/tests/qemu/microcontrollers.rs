//! Every model and kind of recipe on microcontrollers: agreement with the host, and budgets.

use glimpse_bench::recipes;
use glimpse_bench::{is_missing, measure};
use glimpse_core::fit::{AnyModel, Channels, ScanModel};
use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::loss::cosine_weighted_log_error;
use glimpse_core::recipe::Recipe;
use glimpse_kernels::scan::scan_with_missing;
use glimpse_tests::budgets::Budgets;
use glimpse_tests::device::bits;
use glimpse_tests::figures::{Extent, FIT_BINARIES, FitBinary, demo_figures, figures};
use glimpse_tests::microcontroller::{BOARD, Binary, MathLibrary, TARGETS, Target};

/// Returns the bits of a target's fit: parameters or coefficients.
fn fit_on(target: Target, name: &str) -> Vec<u32> {
    let output = Binary::new(target, MathLibrary::Libm, name).run();
    bits(&output.numbers("parameters"))
}

/// Returns the bits of the host's fit of the same readings.
fn fit_on_host(recipe: &Recipe<'_>) -> Vec<u32> {
    let outcome = scan_with_missing(recipe, &mut |_, angles| Some(measure(angles).brdf));
    bits(&outcome.unwrap().values)
}

/// Returns the mean residual before the fit. With Linear, it is that of the mean material.
fn initial_residual(recipe: &Recipe<'_>) -> f32 {
    let estimator = recipe.estimator();
    let functions = AnyModel::functions(recipe.model()).unwrap();
    let mut words = vec![0.0; estimator.words(recipe.samples())];
    estimator.start(&mut words, Channels::Color);
    let errors = recipe.pattern().enumerate().map(|(index, angles)| {
        let at = HalfDifference::from_angles(angles);
        let modeled = estimator.at_sample(functions, &words, index, &at);
        let measured = measure(angles).brdf;
        let loss = cosine_weighted_log_error(measured, modeled, at.cos_theta_i(), 1.0 / 3.0);
        loss.error.value()
    });
    errors.sum::<f32>() / recipe.samples() as f32
}

/// Checks that targets and the host compute the same bits.
fn assert_bits_of_host(extent: Extent) {
    for fit in FIT_BINARIES {
        let expected = fit_on_host(&Recipe::parse(fit.recipe).unwrap());
        for target in TARGETS {
            if !fit.is_built(extent, target, MathLibrary::Libm) {
                continue;
            }
            let actual = fit_on(target, fit.name);
            assert_eq!(actual, expected, "{} on {}", fit.name, target.triple);
        }
    }
}

#[test]
fn board_matches_host_fit_bit_for_bit() {
    assert_bits_of_host(Extent::Board);
}

/// Floating point in hardware and in software, on Arm and RISC-V, rounds the same way.
#[test]
fn all_targets_match_host_fit_bit_for_bit() {
    assert_bits_of_host(Extent::All);
}

/// A recipe that tolerates missing readings fits the rest when every third reading is missing. The result differs from
/// that of all readings.
#[test]
fn board_matches_host_fit_with_missing_readings() {
    for (name, recipe) in [
        ("linear-lost", recipes::MASKED_LINEAR),
        ("neural-lost", recipes::MASKED_NEURAL),
    ] {
        let recipe = Recipe::parse(recipe).unwrap();
        let mut measure_some = |index, angles| (!is_missing(index)).then(|| measure(angles).brdf);
        let expected = scan_with_missing(&recipe, &mut measure_some)
            .unwrap()
            .values;
        let actual = fit_on(BOARD, name);
        assert_eq!(actual, bits(&expected), "{name}");
        assert_ne!(actual, fit_on_host(&recipe), "{name}");
    }
}

/// micromath is less accurate, and the loss has kinks at which a residual changes its sign, so its fits have other
/// parameters. They still reduce the initial residual by at least 30 %.
#[test]
fn micromath_fits_reduce_residual() {
    let has_both = |fit: &FitBinary| fit.is_built(Extent::All, BOARD, MathLibrary::Micromath);
    for FitBinary { name, recipe, .. } in FIT_BINARIES.into_iter().filter(has_both) {
        let before = initial_residual(&Recipe::parse(recipe).unwrap());
        let [libm, micromath] = [MathLibrary::Libm, MathLibrary::Micromath].map(|library| {
            let output = Binary::new(BOARD, library, name).run();
            output.numbers("residual")[0]
        });
        let is_reduced = libm < 0.7 * before && micromath < 1.05 * libm;
        assert!(is_reduced, "{name}: {before}, {libm}, {micromath}");
    }
}

/// Prints figures, and checks them against the budgets.
fn assert_within_budgets(extent: Extent) {
    let mut figures = figures(extent);
    let violations = Budgets::load().violations(&figures, extent);
    figures.extend(demo_figures());
    for (name, value) in figures {
        println!("{name}={value}");
    }
    assert!(violations.is_empty(), "{}", violations.join("\n"));
}

#[test]
fn board_is_within_budgets() {
    assert_within_budgets(Extent::Board);
}

#[test]
fn all_figures_are_within_budgets() {
    assert_within_budgets(Extent::All);
}
