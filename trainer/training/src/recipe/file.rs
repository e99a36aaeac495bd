//! Recipes as files.

use std::io;
use std::path::{Path, PathBuf};

use glimpse_core::geometry::Angles;
use glimpse_core::gonio::Limits;
use glimpse_core::recipe::{
    self, Expectation, Field, HEADER_BYTES, Ingredients, Kind, MAX_COMPONENTS, MAX_SAMPLES, Noise,
    PackedCompletion, PackedDescent, PackedLearner, PackedRidge, PackedStart, Provenance, Recipe,
    RecipeError, Training,
};
use glimpse_kernels::completion::split_lists;
use glimpse_materials::basis::{Basis, BasisError};
use glimpse_materials::untrusted::read_at_most;
use self_cell::self_cell;

use super::quantise::quantised;
use crate::linear::ReducedBasis;
use crate::meta::learned::{LearnedCompleted, LearnedDescent, LearnedTarget};

/// Why a recipe file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum RecipeFileError {
    /// The operating system refuses.
    #[error("cannot read the recipe {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The bytes are not a recipe.
    #[error("{}: {source}; make one with `trainer train`", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Why.
        source: RecipeError,
    },
    /// The basis that belongs to it cannot be used.
    #[error(transparent)]
    Basis(#[from] BasisError),
}

/// The longest recipe file that is read: four times the format's largest list, the basis of a ridge problem. The
/// rest is for names of materials.
const MOST_BYTES: u64 = 4 * (MAX_SAMPLES * MAX_COMPONENTS * size_of::<f32>()) as u64;

/// A recipe, and what it states about itself.
#[derive(Debug)]
struct Parsed<'a> {
    recipe: Recipe<'a>,
    statements: recipe::Statements<'a>,
}

self_cell! {
    struct Owned {
        owner: Vec<u8>,
        #[covariant]
        dependent: Parsed,
    }

    impl {Debug}
}

/// A recipe that owns its bytes, parsed once.
#[derive(Debug)]
pub struct RecipeFile(Owned);

impl RecipeFile {
    /// Reads and checks a recipe file.
    ///
    /// # Errors
    /// If it cannot be read or is not a recipe.
    pub fn read(path: &Path) -> Result<Self, RecipeFileError> {
        let bytes = read_at_most(path, MOST_BYTES).map_err(|source| RecipeFileError::Read {
            path: path.into(),
            source,
        })?;
        Self::new(bytes).map_err(|source| RecipeFileError::Damaged {
            path: path.into(),
            source,
        })
    }

    /// Reads a recipe file and, for the model Linear, the basis that was written beside it.
    ///
    /// # Errors
    /// If one of them cannot be read, or they do not belong together.
    pub fn read_with_basis(path: &Path) -> Result<(Self, Option<Basis>), RecipeFileError> {
        let file = Self::read(path)?;
        let checksum = file.recipe().learner().basis_checksum();
        let basis = checksum.map(|checksum| Basis::read(&Basis::beside(path), checksum));
        Ok((file, basis.transpose()?))
    }

    /// Parses a recipe's bytes.
    ///
    /// # Errors
    /// If they are not a recipe, or one of its statements is damaged.
    pub fn new(bytes: Vec<u8>) -> Result<Self, RecipeError> {
        let owned = Owned::try_new(bytes, |bytes| {
            let recipe = Recipe::parse(bytes)?;
            let statements = recipe.statements()?;
            Ok::<_, RecipeError>(Parsed { recipe, statements })
        });
        owned.map(Self)
    }

    /// Returns the bytes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        self.0.borrow_owner()
    }

    /// Returns the recipe.
    #[must_use]
    pub fn recipe(&self) -> Recipe<'_> {
        self.0.borrow_dependent().recipe
    }

    /// Returns the statements of the recipe about itself.
    #[must_use]
    pub fn statements(&self) -> recipe::Statements<'_> {
        self.0.borrow_dependent().statements
    }

    /// Returns the recipe without the names of its materials, as flash holds it.
    ///
    /// # Errors
    /// None: the recipe was parsed.
    pub fn stripped(&self) -> Result<Self, RecipeError> {
        let mut buffer = vec![0; self.bytes().len()];
        let bytes = self
            .recipe()
            .copy_without(&[Kind::MATERIALS], &mut buffer)?;
        Self::new(bytes.to_vec())
    }
}

/// Bytes that suffice for all that is not counted one by one.
const ROOM: usize = 256;

/// What a recipe states about itself.
#[derive(Clone, Debug, Default)]
pub struct Statements<'a> {
    /// The machine that its pattern was made for.
    pub limits: Option<Limits>,
    /// The noise that it was trained for.
    pub noise: Option<Noise>,
    /// The loss to expect.
    pub expectation: Option<Expectation<'a>>,
    /// Where it came from.
    pub provenance: Option<Provenance<'a>>,
    /// Names and digests of the materials that it was trained on.
    pub materials: Vec<(&'a str, u32)>,
    /// What predicts the loss of a material's fit, where readings are completed: a bias, and a weight
    /// for each coefficient.
    pub prediction: Option<&'a [f32]>,
    /// The training, in types.
    pub training: Option<Training<'a>>,
}

impl Statements<'_> {
    /// Bytes that their texts take.
    fn text_bytes(&self) -> usize {
        let texts = self
            .provenance
            .map(|p| [p.trainer, p.data, p.schedule, p.options]);
        let texts = texts.iter().flatten().map(|text| text.len());
        let on = self
            .expectation
            .map_or(0, |expectation| expectation.on.len());
        // Digest and length of a name take ten bytes at most.
        let names = self.materials.iter().map(|(name, _)| name.len() + 10);
        let sources = self.training.into_iter().flat_map(|each| each.sources);
        // Lengths, counts and a share take twenty.
        let labels = sources.map(|source| source.label.len() + 20);
        texts.sum::<usize>() + on + names.sum::<usize>() + labels.sum::<usize>()
    }
}

/// Writes down a recipe of a model that is fitted by descent.
///
/// # Errors
/// If a number is not finite, or another rule of the format is broken.
pub fn to_recipe(
    learned: &LearnedDescent,
    statements: &Statements<'_>,
) -> Result<RecipeFile, RecipeError> {
    let initial = packed(&learned.initial);
    let step_sizes = packed(&learned.step_sizes);
    let descent = PackedDescent {
        model: learned.model,
        inner_steps: u16::try_from(learned.inner_steps)
            .map_err(|_| RecipeError::Count(Field::InnerSteps))?,
        initial: &initial,
        step_sizes: &step_sizes,
    };
    write(
        &learned.pattern,
        PackedLearner::Descent(descent),
        initial.len() + step_sizes.len(),
        statements,
    )
}

/// Writes down a recipe of the model Linear.
///
/// # Errors
/// If a list has a wrong length, a number is not finite, or another rule of the format is broken.
pub fn to_ridge_recipe(
    reduced: &ReducedBasis,
    statements: &Statements<'_>,
) -> Result<RecipeFile, RecipeError> {
    let [basis, mean, median, weight, precision] = [
        &reduced.basis,
        &reduced.mean,
        &reduced.median,
        &reduced.weight,
        &reduced.precision,
    ]
    .map(|list| packed(list));
    let ridge = PackedRidge {
        components: u16::try_from(reduced.precision.len())
            .map_err(|_| RecipeError::Count(Field::Components))?,
        basis: &basis,
        mean: &mean,
        median: &median,
        weight: &weight,
        precision: &precision,
        basis_checksum: reduced.basis_checksum,
    };
    write(
        &reduced.pattern,
        PackedLearner::Ridge(ridge),
        basis.len() + mean.len() + median.len() + weight.len() + precision.len(),
        statements,
    )
}

/// Writes down a recipe that completes readings.
///
/// # Errors
/// If a number is not finite, or another rule of the format is broken.
pub fn to_completed_recipe(
    learned: &LearnedCompleted,
    statements: &Statements<'_>,
) -> Result<RecipeFile, RecipeError> {
    let shape = learned.shape;
    let (rows, components) = (shape.rows(), shape.components);
    let [readings, bias, output] = split_lists(&learned.completion, shape.completion_lengths());
    let (readings, reading_scales) = quantised(readings, rows, |index| index % rows);
    let hidden = shape.hidden.max(1);
    let (output, output_scales) = quantised(output, components, |index| index / hidden);
    let [centre, reading_scales, bias, output_scales] =
        [&learned.centre[..], &reading_scales, bias, &output_scales].map(packed);
    let mut completion = PackedCompletion {
        components: u16::try_from(components).map_err(|_| RecipeError::Count(Field::Components))?,
        missing: learned.missing as u8,
        centre: &centre,
        scale: learned.scale,
        readings: &readings,
        reading_scales: &reading_scales,
        bias: &bias,
        output: &output,
        output_scales: &output_scales,
        rows: &[],
        row_scales: &[],
        basis_checksum: 0,
    };
    let bytes = readings.len() + output.len() + centre.len() + bias.len();
    let bytes = bytes + reading_scales.len() + output_scales.len();
    match &learned.target {
        LearnedTarget::Linear { rows, basis } => {
            let (rows, scales) = quantised(rows, components, |index| index % components);
            let scales = packed(&scales);
            completion.rows = &rows;
            completion.row_scales = &scales;
            completion.basis_checksum = Basis::checksum(basis);
            let learner = PackedLearner::Completed(completion, None);
            let bytes = bytes + rows.len() + scales.len();
            write(&learned.pattern, learner, bytes, statements)
        }
        LearnedTarget::Descent {
            inner_steps,
            initial,
            step_sizes,
            start,
        } => {
            let [hidden, bias, output] = split_lists(start, shape.start_lengths());
            let inputs = 3 * components;
            let (hidden, hidden_scales) = quantised(hidden, shape.units, |index| index / inputs);
            let units = shape.units;
            let (output, output_scales) =
                quantised(output, shape.parameters, |index| index / units);
            let [hidden_scales, bias, output_scales, initial, step_sizes] = [
                &hidden_scales[..],
                bias,
                &output_scales,
                initial,
                step_sizes,
            ]
            .map(packed);
            let start = PackedStart {
                hidden: &hidden,
                hidden_scales: &hidden_scales,
                bias: &bias,
                output: &output,
                output_scales: &output_scales,
            };
            let descent = PackedDescent {
                model: learned.model,
                inner_steps: u16::try_from(*inner_steps)
                    .map_err(|_| RecipeError::Count(Field::InnerSteps))?,
                initial: &initial,
                step_sizes: &step_sizes,
            };
            let bytes = bytes + hidden.len() + output.len() + hidden_scales.len() + bias.len();
            let bytes = bytes + output_scales.len() + initial.len() + step_sizes.len();
            let learner = PackedLearner::Completed(completion, Some((descent, start)));
            write(&learned.pattern, learner, bytes, statements)
        }
    }
}

/// Writes a recipe whose learner has lists of so many bytes.
fn write(
    pattern: &[Angles<f32>],
    learner: PackedLearner<'_>,
    learner_bytes: usize,
    statements: &Statements<'_>,
) -> Result<RecipeFile, RecipeError> {
    let coordinates: Vec<f32> = pattern
        .iter()
        .flat_map(|angles| [angles.theta_h, angles.theta_d, angles.phi_d])
        .collect();
    let pattern = packed(&coordinates);
    let prediction = statements.prediction.map(packed);
    let ingredients = Ingredients {
        pattern: &pattern,
        learner,
        limits: statements.limits,
        noise: statements.noise,
        expectation: statements.expectation,
        provenance: statements.provenance,
        materials: &statements.materials,
        prediction: prediction.as_deref(),
        training: statements.training,
    };
    let room = HEADER_BYTES + pattern.len() + learner_bytes + statements.text_bytes() + ROOM;
    let room = room + prediction.as_ref().map_or(0, Vec::len);
    let mut buffer = vec![0; room];
    let bytes = Recipe::write(&ingredients, &mut buffer)?.to_vec();
    RecipeFile::new(bytes)
}

fn packed(values: &[f32]) -> Vec<u8> {
    values.iter().copied().flat_map(f32::to_le_bytes).collect()
}
