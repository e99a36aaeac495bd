//! Internal functions of `glimpse-core` that training uses, with any input.

use core::hint::black_box;

use glimpse_core::fit::Target;
use glimpse_core::fit::coefficient_net::{
    CoefficientNet, CoefficientNetGradient, InitNet, InitNetGradient, Input, Plain, standardized,
};
use glimpse_core::fit::ridge::{Problem, RidgeGradient, factor_length, scratch_length};
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_core::model::linear::{Basis, map, unmap};
use glimpse_core::numeric::math;
use glimpse_core::recipe::{FitMethod, Floats, Recipe, RecipeParts};

use crate::{any, bytes, directions, numbers};

#[inline(never)]
pub(crate) fn elementary_functions() {
    let at = HalfDifference::from_angles(Angles {
        theta_h: any(0.1),
        theta_d: any(0.2),
        phi_d: any(0.3),
    });
    black_box((
        at.cos_theta_i(),
        at.cos_theta_o(),
        at.is_valid(),
        at.directions(),
    ));
    black_box(HalfDifference::from_directions(&directions()));
    let x = any(1.0);
    black_box((math::exp(x), math::ln(x), math::sqrt(x), math::sin_cos(x)));
    black_box((map(x, x, x), unmap(x, x, x), math::atan2(x, any(2.0))));
    if let Ok(basis) = Basis::parse(bytes()) {
        black_box(basis.nodes());
        black_box(basis.brdf([numbers(), numbers(), numbers()], &at));
    }
}

#[inline(never)]
pub(crate) fn recipe() {
    let Ok(recipe) = Recipe::parse(bytes()) else {
        return;
    };
    let mut buffer = [0; 64];
    let mut parts = RecipeParts::new(bytes(), recipe.method().into());
    if let Ok(metadata) = recipe.metadata() {
        parts.limits = metadata.limits;
        parts.noise = metadata.noise;
        parts.expectation = metadata.expectation;
        parts.provenance = metadata.provenance;
        parts.training = metadata.training;
        metadata.materials.for_each(|material| {
            black_box(material);
        });
    }
    let _ = black_box(Recipe::write(&parts, black_box(&mut buffer[..])));
    match recipe.method() {
        FitMethod::Descent(descent) => {
            black_box((descent.model(), descent.inner_steps()));
            black_box((descent.initial(), descent.step_sizes()));
        }
        FitMethod::Ridge(ridge) => {
            black_box((ridge.problem(), ridge.components(), ridge.basis()));
            black_box((ridge.mean(), ridge.median(), ridge.weight()));
            black_box((ridge.precision(), ridge.basis_checksum()));
        }
        FitMethod::Completed(completed) => {
            black_box((completed.model(), completed.tolerates_missing()));
            black_box((completed.center(), completed.scale()));
            let completion = completed.coefficient_net();
            black_box((completion.rows(), completion.hidden(), completion.words()));
            if let Some(at_samples) = completed.at_samples() {
                black_box((at_samples.rows(), at_samples.scales()));
            }
            match completed.target() {
                Target::Linear(components) => {
                    black_box(components.basis_checksum());
                }
                Target::Descent(descent, start) => {
                    black_box((descent.initial(), start.units()));
                }
                Target::GaussNewton(steps, start) => {
                    let readings = steps.virtual_readings();
                    black_box((steps.initial(), steps.precision(), start.units()));
                    black_box((
                        readings.center(),
                        readings.components().rows(),
                        readings.components().scales(),
                    ));
                    black_box(readings.get(any(3), [numbers(); 3].map(|_| &[][..])));
                }
            }
        }
    }
    black_box(recipe.completed().is_some());
    if let Some(mut floats) = Floats::new(bytes()) {
        black_box((floats.take(any(3)), floats.len(), floats.is_empty()));
        floats.iter().for_each(|value| {
            black_box(value);
        });
    }
}

/// A coefficient net and an init net with lists of any length, and their adjoints.
#[inline(never)]
pub(crate) fn completion() {
    let completion = CoefficientNet::<f32, Plain> {
        components: any(5),
        readings: numbers(),
        scales: numbers(),
        bias: numbers(),
        output: numbers(),
        output_scales: numbers(),
    };
    let channels = any([0.5; 3]).map(|brdf| standardized(brdf, any(0.5), any(4.0), any(0.5)));
    let inputs = any([Input {
        channels,
        missing: any(0.0),
    }; 4]);
    let inputs = inputs.get(..any(4)).unwrap_or_default();
    let mut buffers = [[0.0; 32]; 7];
    let lists = black_box(&mut buffers).each_mut();
    let [state, by_state, a, b, c, by_units, units] =
        lists.map(|list| list.get_mut(..any(32)).unwrap_or_default());
    completion.compute(inputs, state);
    let mut by_inputs = [[0.0; 3]; 4];
    let by_inputs = black_box(&mut by_inputs).get_mut(..any(4));
    let mut gradient = CoefficientNetGradient {
        readings: &mut *a,
        bias: &mut *b,
        output: &mut *c,
    };
    let by_inputs = by_inputs.unwrap_or_default();
    completion.adjoint(inputs, state, by_state, &mut gradient, by_inputs);
    let start = InitNet::<f32, Plain> {
        hidden: numbers(),
        hidden_scales: numbers(),
        bias: numbers(),
        output: numbers(),
        output_scales: numbers(),
    };
    let coefficients = completion.coefficients(state);
    start.activate(coefficients, units);
    black_box(start.offset(any(3), units));
    start.offsets(any(3), units, by_state);
    let mut gradient = InitNetGradient {
        hidden: a,
        bias: b,
        output: c,
    };
    let mut by_coefficients = [[0.0; 32]; 3];
    let by_coefficients = black_box(&mut by_coefficients).each_mut();
    let by_coefficients = by_coefficients.map(|list| list.get_mut(..any(32)).unwrap_or_default());
    start.adjoint(
        coefficients,
        units,
        numbers(),
        by_units,
        &mut gradient,
        by_coefficients,
    );
    black_box(&buffers);
}

#[inline(never)]
pub(crate) fn ridge() {
    let Ok(problem) = Problem::new(numbers(), numbers()) else {
        return;
    };
    let (samples, components) = (any(problem.samples()), any(problem.components()));
    black_box((
        factor_length(any(8), any(5)),
        scratch_length(any(8), any(5)),
        problem.order(),
    ));
    let mut buffers = [[0.0; 32]; 6];
    let [a, b, c, d, e, f] = black_box(&mut buffers);
    let [a, b, c, d, e, f] =
        [a, b, c, d, e, f].map(|list| list.get_mut(..any(32)).unwrap_or_default());
    black_box((samples, components));
    if let Ok(factors) = problem.factorize::<f32>(a, b) {
        black_box(factors.coefficients(numbers(), c, b).is_ok());
        black_box(factors.solve(numbers(), c, b).is_ok());
        let mut gradient = RidgeGradient {
            basis: d,
            mapped: e,
            precision: f,
        };
        black_box(
            factors
                .adjoint(numbers(), numbers(), numbers(), &mut gradient, b)
                .is_ok(),
        );
    }
}
