//! The models that a scan accepts as its type parameter.

use super::gauss_newton;
use crate::geometry::HalfDifference;
use crate::model::{CookTorrance, Model, ModelKind, Neural, ParameterSet, Phong, Samples};

/// A type parameter of a scan: one of the four models, or [`AnyModel`] for that of the recipe.
pub trait ScanModel {
    /// Returns the functions of the recipe's model, or the firmware's model if it is another one.
    #[doc(hidden)]
    fn functions(recipe: ModelKind) -> Result<&'static Functions, ModelKind>;
}

/// The functions of a model that its fit calls. Parameters are a list in the model's order. All else is not generic, so
/// that firmware contains it once and not for each model.
#[derive(Clone, Copy, Debug)]
pub struct Functions {
    /// Adds the loss gradients of samples to a gradient.
    pub(super) add_gradients: fn(&[f32], Samples<'_>, &mut [f32]),
    /// Adds a reading to the systems of a Gauss-Newton step.
    pub(super) add_reading: AddReading,
    /// Returns the BRDF in linear RGB, sr^-1, not times the cosine.
    pub(super) brdf: fn(&[f32], &HalfDifference<f32>) -> [f32; 3],
}

pub(super) type AddReading = fn(&[f32], &HalfDifference<f32>, [f32; 3], [f32; 2], &mut [f32]);

/// The model Linear: principal components of measured materials, fitted by a ridge solve.
///
/// The values of a fit are the coefficients: K for red, K for green, K for blue. A
/// [`Basis`](crate::model::linear::Basis) converts them to a BRDF.
#[derive(Clone, Copy, Debug)]
pub struct Linear;

/// The model that the recipe names. One firmware accepts recipes of all four models at run time, and links the code of
/// all of them.
///
/// ```
/// use glimpse_core::fit::AnyModel;
/// use glimpse_core::recipe::{Recipe, memory_words};
/// use glimpse_core::scan::Scan;
///
/// static RECIPES: [&[u8]; 2] = [
///     include_bytes!("../../examples/recipes/linear-n8.recipe"),
///     include_bytes!("../../examples/recipes/neural-n8.recipe"),
/// ];
/// let mut memory = [0.0; memory_words(&RECIPES)]; // enough for each of them
/// for bytes in RECIPES {
///     let scan = Scan::<AnyModel>::new(Recipe::parse(bytes)?, &mut memory)?;
///     println!("{}", scan.recipe().model());
/// }
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct AnyModel;

fn expect(firmware: ModelKind, recipe: ModelKind) -> Result<(), ModelKind> {
    match recipe == firmware {
        true => Ok(()),
        false => Err(firmware),
    }
}

impl<M: Model> ScanModel for M {
    fn functions(recipe: ModelKind) -> Result<&'static Functions, ModelKind> {
        expect(M::KIND, recipe)?;
        Ok(&const {
            Functions {
                add_gradients: add_gradients::<M>,
                add_reading: add_reading::<M>,
                brdf: brdf::<M>,
            }
        })
    }
}

impl ScanModel for Linear {
    fn functions(recipe: ModelKind) -> Result<&'static Functions, ModelKind> {
        expect(ModelKind::Linear, recipe)?;
        // Linear has neither parameters nor steps.
        Ok(&const {
            Functions {
                add_gradients: |_, _, _| (),
                add_reading: |_, _, _, _, _| (),
                brdf: |_, _| [f32::NAN; 3],
            }
        })
    }
}

impl ScanModel for AnyModel {
    fn functions(recipe: ModelKind) -> Result<&'static Functions, ModelKind> {
        match recipe {
            ModelKind::Phong => Phong::functions(recipe),
            ModelKind::Neural => Neural::functions(recipe),
            ModelKind::CookTorrance => CookTorrance::functions(recipe),
            ModelKind::Linear => Linear::functions(recipe),
        }
    }
}

// Not inlined, so that their stack is released between slices of work.

#[inline(never)]
fn add_gradients<M: Model>(parameters: &[f32], samples: Samples<'_>, gradient: &mut [f32]) {
    let views = M::Parameters::view(parameters).zip(M::Parameters::view_mut(gradient));
    if let Some((parameters, gradient)) = views {
        M::accumulate_gradients(parameters, samples, gradient);
    }
}

#[inline(never)]
fn add_reading<M: Model>(
    parameters: &[f32],
    at: &HalfDifference<f32>,
    measured: [f32; 3],
    weights: [f32; 2],
    systems: &mut [f32],
) {
    if let Some(parameters) = M::Parameters::view(parameters) {
        gauss_newton::add_reading::<M, f32>(parameters, at, measured, weights, systems);
    }
}

#[inline(never)]
fn brdf<M: Model>(parameters: &[f32], at: &HalfDifference<f32>) -> [f32; 3] {
    let parameters = M::Parameters::view(parameters);
    parameters.map_or([f32::NAN; 3], |parameters| M::brdf::<f32>(parameters, at))
}
