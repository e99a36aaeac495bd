//! The reflectance models, each with its loss and gradient in one function.
//!
//! Firmware names a model and leaves the rest to [`scan`](crate::scan). Gradients
//! ([`Model::accumulate_gradient`] with its `SAMPLE`, [`Evaluation`], [`SampleGradient`]) are public
//! because the trainer computes by the very code that is flashed; they are **not part of this crate's
//! promise** and may change in any version.

mod cook_torrance;
pub mod linear;
pub mod loss;
mod neural;
mod parameters;
mod phong;

/// Numbers that readings are completed in before a descent.
pub const SCRATCH: usize = 416;

pub use cook_torrance::{CookTorrance, CookTorranceParameters};
pub use neural::{Neural, NeuralParameters};
pub use phong::{Phong, PhongParameters};

use serde::{Deserialize, Serialize};

use crate::geometry::HalfDifference;
use crate::model::loss::LogError;
use crate::numeric::{Block, Scalar, Value};

/// Names a model in recipes and on the link. The order of those that are fitted by descent is part
/// of the recipe format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ModelKind {
    /// [`Phong`].
    Phong = 0,
    /// [`Neural`].
    Neural = 1,
    /// [`CookTorrance`].
    CookTorrance = 2,
    /// Principal components and a ridge solve, see [`crate::fit::ridge`]: the one model that has no
    /// descent. Recipes do not write its number, so that it may stay the last.
    Linear = 3,
}

impl ModelKind {
    /// The name on the command line and in exported files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Phong => "phong",
            Self::Neural => "neural",
            Self::CookTorrance => "cook-torrance",
            Self::Linear => "linear",
        }
    }
}

impl core::fmt::Display for ModelKind {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}

/// One number for every parameter of a model: the parameters themselves, their gradient, their
/// step sizes.
pub trait ParameterSet<T: Value>: Clone + Send + Sync {
    /// All entries equal.
    fn filled(value: T) -> Self;
    /// The entries as runs, in the order that recipes and exports use.
    fn runs(&self) -> impl Iterator<Item = &[T]>;
    /// The same, to be changed.
    fn runs_mut(&mut self) -> impl Iterator<Item = &mut [T]>;

    /// All entries, in order.
    fn iter(&self) -> impl Iterator<Item = &T> {
        self.runs().flatten()
    }

    /// All entries in order, to be changed.
    fn iter_mut(&mut self) -> impl Iterator<Item = &mut T> {
        self.runs_mut().flatten()
    }
}

/// One measured sample of a BRDF.
#[derive(Clone, Copy, Debug)]
pub struct Sample<S> {
    /// Where it was measured.
    pub at: HalfDifference<S>,
    /// What was measured: the BRDF y in linear RGB, sr^-1 (not times the cosine).
    pub measured: [S; 3],
    /// Its weight in the loss: 1 / (3 n) for the mean over n samples and three channels.
    pub weight: S,
}

impl Sample<f32> {
    /// Nothing, nowhere: so that statics can begin with it.
    pub(crate) const ZERO: Self = Self {
        at: HalfDifference {
            hx: 0.0,
            hz: 0.0,
            dx: 0.0,
            dy: 0.0,
            dz: 0.0,
        },
        measured: [0.0; 3],
        weight: 0.0,
    };
}

impl<const N: usize> Sample<Block<N>> {
    /// At most `N` samples side by side. If they are fewer, the last stands in for the missing
    /// ones, at weight 0.
    #[inline(always)]
    pub fn gather(samples: &[Sample<f32>]) -> Self {
        let zero = Block::constant(0.0);
        let Some(last) = samples.last() else {
            return Self {
                at: HalfDifference::zero(),
                measured: [zero; 3],
                weight: zero,
            };
        };
        let each = |of: fn(&Sample<f32>) -> f32| {
            let mut numbers = [0.0; N];
            for (lane, number) in numbers.iter_mut().enumerate() {
                *number = of(samples.get(lane).unwrap_or(last));
            }
            Block(numbers)
        };
        let mut weight = zero;
        for (weight, sample) in weight.0.iter_mut().zip(samples) {
            *weight = sample.weight;
        }
        Self {
            at: HalfDifference {
                hx: each(|sample| sample.at.hx),
                hz: each(|sample| sample.at.hz),
                dx: each(|sample| sample.at.dx),
                dy: each(|sample| sample.at.dy),
                dz: each(|sample| sample.at.dz),
            },
            measured: [
                each(|sample| sample.measured[0]),
                each(|sample| sample.measured[1]),
                each(|sample| sample.measured[2]),
            ],
            weight,
        }
    }
}

/// The derivatives of the loss by what a sample was taken at and by what was measured there.
#[derive(Clone, Copy, Debug)]
pub struct SampleGradient<S> {
    /// By the half and the difference vector, as if their five coordinates were independent.
    pub at: HalfDifference<S>,
    /// By the measured BRDF.
    pub measured: [S; 3],
}

impl<S: Scalar> SampleGradient<S> {
    /// All 0.
    #[inline(always)]
    pub fn zero() -> Self {
        Self {
            at: HalfDifference::zero(),
            measured: [S::constant(0.0); 3],
        }
    }
}

/// The weighted loss of a sample, and its derivatives by the sample.
#[derive(Clone, Copy, Debug)]
pub struct Evaluation<S> {
    /// The error.
    pub error: LogError<S>,
    /// Zero unless it was asked for.
    pub gradient: SampleGradient<S>,
}

impl<S: Scalar> Evaluation<S> {
    /// The loss, times the sample's weight.
    #[inline(always)]
    pub fn loss(&self) -> S {
        self.error.value()
    }
}

/// How many samples are computed side by side.
const BLOCK: usize = 4;

/// A reflectance model: f_r(x; theta), differentiable in theta and x.
pub trait Model: Sync {
    /// The model's name.
    const KIND: ModelKind;
    /// How many parameters it has.
    const PARAMETERS: usize;
    /// One `T` for every parameter.
    type Parameters<T: Value>: ParameterSet<T>;
    /// All zeros, as a constant: so that statics can begin with it.
    const ZEROS: Self::Parameters<f32>;
    /// Room for [`SCRATCH`] numbers, or for none where a run of the gradient, which is idle before a
    /// descent, has as many.
    type Scratch: AsMut<[f32]> + Clone + core::fmt::Debug + Send + Sync;
    /// All zeros.
    const NO_SCRATCH: Self::Scratch;

    /// The BRDF in linear RGB, sr^-1, not times the cosine.
    fn brdf<S: Scalar>(
        parameters: &Self::Parameters<S::Parameter>,
        at: &HalfDifference<S>,
    ) -> [S; 3];

    /// The weighted loss at one sample; adds its gradient by the parameters to `gradient`.
    ///
    /// With `SAMPLE`, the gradient by the sample's coordinates and measured value comes back too.
    /// (For the trainer; not part of this crate's promise.)
    fn accumulate_gradient<S: Scalar, const SAMPLE: bool>(
        parameters: &Self::Parameters<S::Parameter>,
        sample: &Sample<S>,
        gradient: &mut Self::Parameters<S::Sum>,
    ) -> Evaluation<S>;

    /// What descent calls: adds the gradients of all `samples` by the parameters to `gradient`.
    ///
    /// Some samples side by side, unless a model gains more by taking them one by one.
    #[inline(always)]
    fn accumulate_gradients(
        parameters: &Self::Parameters<f32>,
        samples: &[Sample<f32>],
        gradient: &mut Self::Parameters<f32>,
    ) {
        for block in samples.chunks(BLOCK) {
            let block = Sample::<Block<BLOCK>>::gather(block);
            Self::accumulate_gradient::<_, false>(parameters, &block, gradient);
        }
    }
}

/// One logit for each channel, through sigmoids.
#[inline(always)]
fn sigmoids<S: Scalar>(logits: &[S::Parameter; 3]) -> [S; 3] {
    let [red, green, blue] = *logits;
    [
        S::broadcast_sigmoid(red),
        S::broadcast_sigmoid(green),
        S::broadcast_sigmoid(blue),
    ]
}
