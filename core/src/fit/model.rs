//! The models that a scan accepts as its type parameter.

use core::ops::Range;

use super::channels::Readings;
use super::gauss_newton;
use super::sgd::Sgd;
use super::start::Refinement;
use crate::geometry::HalfDifference;
use crate::model::linear::Basis;
use crate::model::{CookTorrance, Model, ModelKind, Neural, ParameterSet, Phong, Samples};

/// True if the crate has SGD from constant initial parameters.
pub(crate) const SGD: bool = cfg!(feature = "sgd");
/// True if the crate has the stages that begin with coefficients.
pub(crate) const RIDGE: bool = cfg!(feature = "ridge");

/// A type parameter of a scan: one of the four models, or [`AnyModel`] for that of the recipe.
pub trait ScanModel {
    /// Returns the functions of the recipe's model, or the firmware's model if it is another one.
    #[doc(hidden)]
    fn functions(recipe: ModelKind) -> Result<&'static Functions, ModelKind>;
}

/// The part of a fit that depends on the model. Firmware contains the functions of its model only: no basis for Phong, and
/// no steps for Linear. Parameters are a list in the model's order.
#[derive(Clone, Copy, Debug)]
#[allow(clippy::type_complexity)] // signatures read better than their names
pub struct Functions {
    /// Does units of work of SGD.
    pub(super) descend: fn(&Sgd<'_>, &mut [f32], Readings<'_>, Range<u32>),
    /// Does units of work of the stages start and steps, from coefficients.
    pub(super) refine: fn(&Refinement<'_>, &mut [f32], Readings<'_>, [&[f32]; 3], Range<u32>),
    /// Returns the BRDF of parameters in linear RGB, sr^-1, not times the cosine.
    pub(super) brdf: fn(&[f32], &HalfDifference<f32>) -> [f32; 3],
    /// Returns the BRDF of coefficients.
    pub(super) look_up: fn(&Basis<'_>, [&[f32]; 3], &HalfDifference<f32>) -> Option<[f32; 3]>,
}

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
    #[inline]
    fn functions(recipe: ModelKind) -> Result<&'static Functions, ModelKind> {
        expect(M::KIND, recipe)?;
        Ok(&const {
            Functions {
                descend: |sgd, words, readings, units| {
                    if SGD {
                        sgd.advance(add_gradients::<M>, words, readings, units);
                    }
                },
                refine: |refinement, words, readings, coefficients, units| {
                    if RIDGE {
                        refinement.advance(add_reading::<M>, words, readings, coefficients, units);
                    }
                },
                brdf: brdf::<M>,
                look_up: |_, _, _| None,
            }
        })
    }
}

impl ScanModel for Linear {
    #[inline]
    fn functions(recipe: ModelKind) -> Result<&'static Functions, ModelKind> {
        expect(ModelKind::Linear, recipe)?;
        // Linear has neither parameters nor steps.
        Ok(&const {
            Functions {
                descend: |_, _, _, _| (),
                refine: |_, _, _, _, _| (),
                brdf: |_, _| [f32::NAN; 3],
                look_up: |basis, coefficients, at| basis.brdf(coefficients, at),
            }
        })
    }
}

impl ScanModel for AnyModel {
    #[inline]
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
        for sample in samples.iter() {
            M::accumulate_gradient::<f32, false>(parameters, &sample, gradient);
        }
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
