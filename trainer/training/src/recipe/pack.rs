//! The conversion of a training result to the sections of a recipe.

use glimpse_core::fit::{GaussNewton, Net, Noise as ReadingNoise, Prediction, Ridge, Sgd, Start};
use glimpse_core::geometry::Angles;
use glimpse_core::numeric::{Floats, PackedRows};
use glimpse_core::recipe::{Contents, Pattern};
use glimpse_kernels::completion::split_lists;

use super::file::{RecipeDefect, RecipeFile};
use super::metadata::{Metadata, Training};
use super::quantize::quantize;
use crate::meta::learned::{
    LearnedFit, LearnedNet, LearnedRecipe, LearnedRefinement, LearnedRidge, LearnedSgd,
    LearnedSteps,
};
use crate::meta::options::TrainingOptions;

/// The training result is not a valid recipe.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "training did not converge to a valid recipe; train with another seed or with more materials"
)]
pub struct PackError(#[from] RecipeDefect);

/// The bytes of lists, which sections borrow.
#[derive(Default)]
struct Arena(bumpalo::Bump);

impl Arena {
    fn bytes(&self, bytes: &[u8]) -> &[u8] {
        self.0.alloc_slice_copy(bytes)
    }

    fn floats(&self, values: &[f32]) -> Floats<'_> {
        let bytes: Vec<u8> = values.iter().copied().flat_map(f32::to_le_bytes).collect();
        Floats::new(self.bytes(&bytes))
    }

    fn angles(&self, angles: &[Angles<f32>]) -> Floats<'_> {
        let triples = angles.iter();
        let numbers = triples.flat_map(|each| each.to_array());
        self.floats(&numbers.collect::<Vec<_>>())
    }

    /// Quantizes weights; see [`quantize`].
    fn weights(
        &self,
        weights: &[f32],
        rows: usize,
        row_of: impl Fn(usize) -> usize,
    ) -> (&[u8], Floats<'_>) {
        let (bytes, scales) = quantize(weights, rows, row_of);
        (self.bytes(&bytes), self.floats(&scales))
    }

    /// Quantizes rows of components.
    fn rows(&self, rows: &[f32], components: usize) -> PackedRows<'_> {
        let (entries, scales) = self.weights(rows, components, |index| index % components);
        PackedRows { entries, scales }
    }
}

/// Packs a training result and its metadata as a recipe. `data` is the name of the training materials.
///
/// # Errors
/// Fails if the result is not a valid recipe, for example if a number is not finite.
pub fn pack_recipe(
    learned: &LearnedRecipe,
    options: &TrainingOptions,
    data: &str,
) -> Result<RecipeFile, PackError> {
    let metadata = Metadata {
        expected_loss: learned.expected_loss,
        training: Some(Training::new(options, data, learned.materials.len())),
        materials: learned.materials.clone(),
    };
    let arena = Arena::default();
    let loss = learned.expected_loss.map(|each| each.estimate.loss);
    let mut contents = contents(&learned.fit, &learned.pattern, loss, &arena);
    if let Some(pattern) = &mut contents.pattern {
        pattern.is_path = options.scan_seconds.is_some();
    }
    contents.prediction = learned.loss_predictor.as_ref().map(|predictor| {
        let partial = predictor.partial.as_ref();
        let evidence = predictor.uncertainty;
        Prediction {
            weights: arena.floats(&predictor.weights),
            innovation: evidence.innovation,
            residual: evidence.residual,
            bound: evidence.bound,
            max_innovation: evidence.max_innovation,
            partial_loss: arena.floats(partial.map_or(&[], |each| &each.loss)),
            partial_bound: arena.floats(partial.map_or(&[], |each| &each.bound)),
        }
    });
    let metadata = metadata.to_bytes();
    contents.metadata = &metadata;
    Ok(RecipeFile::write(&contents)?)
}

/// Packs a learned fit without metadata.
///
/// # Errors
/// Fails if the fit is not valid.
pub fn pack_fit(
    fit: &LearnedFit,
    pattern: &[Angles<f32>],
    expected_loss: Option<f32>,
) -> Result<RecipeFile, RecipeDefect> {
    let arena = Arena::default();
    RecipeFile::write(&contents(fit, pattern, expected_loss, &arena))
}

fn contents<'a>(
    fit: &LearnedFit,
    pattern: &[Angles<f32>],
    expected_loss: Option<f32>,
    arena: &'a Arena,
) -> Contents<'a> {
    let pattern = Pattern {
        directions: arena.angles(pattern),
        is_path: false,
        expected_loss,
    };
    let mut contents = Contents {
        pattern: Some(pattern),
        ..Contents::default()
    };
    match fit {
        LearnedFit::Sgd(learned) => contents.sgd = Some(sgd(learned, arena)),
        LearnedFit::Ridge {
            net,
            ridge,
            refinement,
        } => {
            let components = ridge.precision.len();
            contents.ridge = Some(packed_ridge(ridge, net.is_some(), arena));
            contents.noise = ridge.noise_variance.map(|variance| ReadingNoise {
                variance,
                scales: Floats::default(),
            });
            contents.net = net.as_ref().map(|learned| packed_net(learned, arena));
            if let Some(learned) = refinement {
                contents.gauss_newton = Some(gauss_newton(&learned.steps, components, arena));
                contents.start = Some(start(learned, arena));
            }
        }
    }
    contents
}

/// Returns a count as the format holds it. The format's limits are smaller, so that larger counts are refused.
fn count(number: usize) -> u16 {
    u16::try_from(number).unwrap_or(u16::MAX)
}

fn sgd<'a>(learned: &LearnedSgd, arena: &'a Arena) -> Sgd<'a> {
    Sgd {
        model: learned.model,
        steps: count(learned.steps),
        initial: arena.floats(&learned.initial),
        step_sizes: arena.floats(&learned.step_sizes),
    }
}

/// The rows are bytes after a net, and f32 in the paper's Linear.
fn packed_ridge<'a>(learned: &LearnedRidge, has_net: bool, arena: &'a Arena) -> Ridge<'a> {
    Ridge {
        precision: arena.floats(&learned.precision),
        difference_precision: arena.floats(&learned.difference_precision),
        center: arena.floats(&learned.center),
        rows: match has_net {
            true => arena.rows(&learned.rows, learned.precision.len()),
            false => PackedRows {
                entries: arena.floats(&learned.rows).words().as_flattened(),
                scales: Floats::default(),
            },
        },
        basis_checksum: learned.basis_checksum,
    }
}

fn packed_net<'a>(learned: &LearnedNet, arena: &'a Arena) -> Net<'a> {
    let shape = learned.shape;
    let rows = shape.rows();
    let [readings, bias, output] = split_lists(&learned.weights, shape.coefficient_net_lengths());
    let (readings, reading_scales) = arena.weights(readings, rows, |index| index % rows);
    let (output, output_scales) =
        arena.weights(output, shape.components, |index| index / shape.hidden);
    Net {
        bias: arena.floats(bias),
        components: count(shape.components),
        missing: learned.missing as u8,
        scale: learned.scale,
        readings,
        reading_scales,
        output,
        output_scales,
    }
}

fn start<'a>(learned: &LearnedRefinement, arena: &'a Arena) -> Start<'a> {
    let shape = learned.shape;
    let [hidden, bias, output] = split_lists(&learned.start_net, shape.start_net_lengths());
    let inputs = hidden.len() / shape.units.max(1);
    let (hidden, hidden_scales) = arena.weights(hidden, shape.units, |index| index / inputs);
    let (output, output_scales) =
        arena.weights(output, shape.parameters, |index| index / shape.units);
    Start {
        bias: arena.floats(bias),
        hidden,
        hidden_scales,
        output,
        output_scales,
    }
}

fn gauss_newton<'a>(
    learned: &LearnedSteps,
    components: usize,
    arena: &'a Arena,
) -> GaussNewton<'a> {
    GaussNewton {
        model: learned.model,
        steps: count(learned.steps),
        initial: arena.floats(&learned.initial),
        precision: arena.floats(&learned.precision),
        reading_weight: learned.reading_weight,
        error_scale: learned.error_scale,
        directions: arena.angles(&learned.directions),
        center: arena.floats(&learned.center),
        rows: arena.rows(&learned.rows, components),
    }
}
