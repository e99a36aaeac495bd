//! The sections of a recipe: their order, their combinations, and the counts that their lists have to match.

use serde::{Deserialize, Serialize};

use super::header;
use crate::error::{Error, ErrorCode};
use crate::fit::{
    Coefficients, Estimator, GaussNewton, Net, Noise, Prediction, RIDGE, Refinement, Ridge, SGD,
    Sgd, Start,
};
use crate::geometry::{Angles, HalfDifference};
use crate::model::ModelKind;
use crate::numeric::Floats;
use crate::section::{Count, Counts, Section, section};

section! {
    /// The directions to measure at.
    Pattern<'a> = 0, "pattern" {
        /// (theta_h, theta_d, phi_d) of each sample: Rusinkiewicz angles in radians, both directions above the horizon.
        /// Empty for readings at any directions
        directions: Floats<'a>, [Samples, Three], in -1000.0 => 1000.0;
        /// 1 if the samples are in the order of a path that takes little time. Otherwise, if a fit tolerates missing
        /// readings, the first 16 are sorted by information, for scans that end early
        is_path: bool;
        /// expected loss on a material that training never saw
        expected_loss: Option<f32>, in 0.0 => f32::MAX;
    }
}

/// The kind of the section that belongs to the trainer.
pub const METADATA: u16 = 129;
/// Kinds from this one on are optional.
const FIRST_OPTIONAL: u16 = 128;

/// The sections of a recipe.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Contents<'a> {
    /// The directions to measure at.
    pub pattern: Option<Pattern<'a>>,
    /// Steps of SGD.
    pub sgd: Option<Sgd<'a>>,
    /// The stage ridge.
    pub ridge: Option<Ridge<'a>>,
    /// The stage net.
    pub net: Option<Net<'a>>,
    /// The stage start.
    pub start: Option<Start<'a>>,
    /// Gauss-Newton steps.
    pub gauss_newton: Option<GaussNewton<'a>>,
    /// The noise of readings.
    pub noise: Option<Noise<'a>>,
    /// The predicted loss.
    pub prediction: Option<Prediction<'a>>,
    /// The trainer's bytes.
    #[serde(skip)]
    pub metadata: &'a [u8],
}

/// Decodes a section as one value that takes all of its bytes.
fn decode<'a, T: Deserialize<'a> + Section>(bytes: &'a [u8]) -> Result<Option<T>, Error> {
    match take_from_bytes(bytes) {
        Some((value, [])) => Ok(Some(value)),
        _ => Err(sections_error(ErrorCode::RecipeSections, T::KIND)),
    }
}

/// Takes a value in postcard's format. Not inlined, so that its stack is released.
#[inline(never)]
fn take_from_bytes<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Option<(T, &'a [u8])> {
    postcard::take_from_bytes(bytes).ok()
}

fn sections_error(code: ErrorCode, kind: u16) -> Error {
    Error::with(code, [kind.into(), 0])
}

impl<'a> Contents<'a> {
    /// Reads the sections of a recipe, without a check of their numbers.
    ///
    /// # Errors
    /// A defect of the header, or of a section's encoding.
    pub fn read(bytes: &'a [u8]) -> Result<Self, Error> {
        Self::decode(header::read(bytes)?.sections)
    }

    /// Decodes a list of sections.
    ///
    /// # Errors
    /// The first defect of their encoding, kinds or order.
    pub fn decode(sections: &'a [u8]) -> Result<Self, Error> {
        let mut contents = Self::default();
        let mut rest = sections;
        let mut previous = None;
        while !rest.is_empty() {
            let ((kind, value), after): ((u16, _), _) =
                take_from_bytes(rest).ok_or(Error::new(ErrorCode::RecipeMalformed))?;
            rest = after;
            // Strictly ascending, so no kind occurs twice.
            if previous >= Some(kind) {
                return Err(sections_error(ErrorCode::RecipeSections, kind));
            }
            previous = Some(kind);
            match kind {
                Pattern::KIND => contents.pattern = decode(value)?,
                Sgd::KIND if SGD => contents.sgd = decode(value)?,
                Ridge::KIND if RIDGE => contents.ridge = decode(value)?,
                Net::KIND if RIDGE => contents.net = decode(value)?,
                Start::KIND if RIDGE => contents.start = decode(value)?,
                GaussNewton::KIND if RIDGE => contents.gauss_newton = decode(value)?,
                Noise::KIND if RIDGE => contents.noise = decode(value)?,
                Prediction::KIND if RIDGE => contents.prediction = decode(value)?,
                METADATA => contents.metadata = value,
                FIRST_OPTIONAL.. => {}
                _ => return Err(sections_error(ErrorCode::RecipeUnknown, kind)),
            }
        }
        Ok(contents)
    }

    /// The counts that the lists of all sections have to match.
    fn counts(&self) -> Counts {
        let mut counts = Counts::default();
        let model = match (&self.sgd, &self.gauss_newton) {
            (Some(sgd), _) => sgd.model,
            (None, Some(steps)) => steps.model,
            (None, None) => ModelKind::Linear,
        };
        counts.set(Count::Three, 3);
        counts.set(Count::Parameters, model.parameters().unwrap_or(0));
        counts.set(Count::Active, model.active().map_or(0, |each| each.count()));
        if let Some(pattern) = &self.pattern {
            counts.set(Count::Samples, pattern.directions.len() / 3);
        }
        if let Some(ridge) = &self.ridge {
            counts.set(Count::Components, ridge.precision.len());
        }
        let mut coefficients = 0;
        if let Some(net) = &self.net {
            coefficients = usize::from(net.components);
            let rows = net.bias.len();
            counts.set(Count::Rows, rows);
            counts.set(Count::Coefficients, coefficients);
            // Too many if m exceeds the number of rows.
            counts.set(Count::Hidden, rows.wrapping_sub(coefficients));
        }
        counts.set(Count::Weights, coefficients.saturating_add(1));
        if let Some(start) = &self.start {
            counts.set(Count::Units, start.bias.len());
        }
        if let Some(steps) = &self.gauss_newton {
            counts.set(Count::VirtualReadings, steps.directions.len() / 3);
        }
        counts
    }

    /// Checks all numbers, and returns the pattern and the estimator.
    ///
    /// # Errors
    /// The first defect.
    pub fn check(&self) -> Result<(Pattern<'a>, Estimator<'a>), Error> {
        let counts = self.counts();
        let missing = |kind| Err(sections_error(ErrorCode::RecipeSections, kind));
        let Some(pattern) = self.pattern else {
            return missing(Pattern::KIND);
        };
        pattern.check(&counts)?;
        // Without a pattern, readings may be at any directions. The basis has the components there.
        let is_any = self.net.is_none() && self.ridge.is_some_and(|each| each.basis_checksum != 0);
        if pattern.directions.is_empty() && !is_any {
            return Err(Error::in_field(
                ErrorCode::RecipeCount,
                "pattern.directions",
            ));
        }
        if let Some(index) = first_below_horizon(pattern.directions) {
            let code = ErrorCode::RecipeBelowHorizon;
            return Err(Error::with(code, [index as u32, 0]));
        }
        let (Some(ridge), true) = (self.ridge, RIDGE) else {
            let Some(sgd) = self.sgd else {
                return missing(if RIDGE { Ridge::KIND } else { Sgd::KIND });
            };
            let others = self.net.is_some() || self.start.is_some() || self.noise.is_some();
            if others || self.gauss_newton.is_some() || self.prediction.is_some() {
                return missing(Ridge::KIND);
            }
            sgd.check(&counts)?;
            return Ok((pattern, Estimator::Sgd(sgd)));
        };
        if self.sgd.is_some() {
            return missing(Sgd::KIND); // it excludes the ridge stage
        }
        ridge.check(&counts)?;
        if let Some(net) = &self.net {
            let code = ErrorCode::RecipeRange;
            if usize::from(net.components) > ridge.precision.len() {
                return Err(Error::in_field(code, "net.components"));
            }
            net.check(&counts)?;
            if net.missing == 1 {
                return Err(Error::in_field(code, "net.missing"));
            }
        }
        self.noise.iter().try_for_each(|each| each.check(&counts))?;
        self.prediction
            .iter()
            .try_for_each(|each| each.check(&counts))?;
        let refinement = match (self.start, self.gauss_newton) {
            (None, None) => None,
            (Some(start), Some(steps)) => {
                steps.check(&counts)?;
                start.check(&counts)?;
                if first_below_horizon(steps.directions).is_some() {
                    let code = ErrorCode::RecipeRange;
                    return Err(Error::in_field(code, "gauss_newton.directions"));
                }
                Some(Refinement { start, steps })
            }
            (None, Some(_)) => return missing(Start::KIND),
            (Some(_), None) => return missing(GaussNewton::KIND),
        };
        let estimator = Estimator::Ridge {
            coefficients: Coefficients {
                net: self.net,
                ridge,
                noise: self.noise,
            },
            refinement,
            prediction: self.prediction,
        };
        Ok((pattern, estimator))
    }
}

fn first_below_horizon(directions: Floats<'_>) -> Option<usize> {
    let mut directions = directions.triples();
    directions
        .position(|angles| !HalfDifference::from_angles(Angles::from_array(angles)).is_valid())
}
