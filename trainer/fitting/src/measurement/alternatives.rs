//! Other ways to read a file, which may explain its numbers better than the stated one.
//!
//! The [`Evidence`] of a file is the density of its numbers for materials of the prior. It is compared between the stated
//! reading and each alternative, at the directions that both have away from the horizon, where the prior is reliable. A
//! material that is unlike all others is improbable, however it is read, so the evidence per reading must exceed a minimum.

use clap::ValueEnum;
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_materials::setting::Name;
use serde::Serialize;
use std::fmt;

use super::angles::{above_horizon, to_directions};
use super::conventions::{AngleArgs, AngleConvention, AngleUnit};
use super::outliers::{OutlierKind, Outliers};
use super::quantity::{Conversion, Multiple, ReadingQuantity};
use super::readings::{Readings, SampleReading};
use crate::choice::Choice;
use crate::linear::{DEFAULT_NOISE, Evidence, Posterior, PosteriorReading};

/// The smallest and the largest number of compared readings.
const READINGS: [usize; 2] = [4, 32];
/// The largest polar angle of compared directions, in degrees.
const MAX_POLAR: f32 = 75.5;
/// The smallest angle of the half vector, in degrees, from which on a reading informs about the quantity.
const MIN_HALF_ANGLE: f32 = 10.0;
/// The evidence of all readings together that is needed beyond that per reading.
const MIN_EVIDENCE: f64 = 1.0;
/// The evidence per reading above its minimum from which on a file is refused.
const REFUSED: f64 = 1.0;

/// Another way to read a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "setting", content = "value", rename_all = "snake_case")]
pub enum Alternative {
    /// With a convention, or without it if it is stated.
    Convention(AngleConvention),
    /// Polar angles in this unit.
    Unit(AngleUnit),
    /// Numbers of this quantity.
    Quantity(Multiple),
}

/// An alternative that explains a file better than the stated reading.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Doubt {
    /// The alternative.
    #[serde(flatten)]
    pub alternative: Alternative,
    /// The logarithm of the ratio of both densities, per reading.
    pub evidence: f64,
    /// True if the alternative is to lack a stated convention.
    pub is_removed: bool,
    /// True if the alternative explains the readings far better.
    pub is_refused: bool,
}

impl Alternative {
    /// The evidence per reading that is needed for a question.
    ///
    /// These minima were chosen by right and wrong files of 64 networks of MERL, in four folds, and of 80 procedural materials;
    /// those of percent, reflectance factors and sRGB also by RGL's 17 measurements.
    fn min_evidence(self, stated: Multiple, has_apertures: bool) -> f64 {
        use AngleConvention::{Exchanged, FromMirror};
        use Multiple::{BrdfCosIO, ReflectanceFactor, ReflectancePercent, Srgb};

        match self {
            Self::Convention(FromMirror | Exchanged) => 0.35,
            Self::Convention(_) => 0.8,
            Self::Unit(_) => 0.5,
            // Black materials resemble bright ones whose numbers are too small.
            // But a sphere also sees the reflection of their surface.
            Self::Quantity(other) if other.brightness() > stated.brightness() => {
                if has_apertures {
                    1.0
                } else {
                    5.0
                }
            }
            Self::Quantity(ReflectanceFactor) => 1.2,
            Self::Quantity(BrdfCosIO | Srgb) => 1.5,
            // Percent that were not stated are frequent, and right files are far from them.
            Self::Quantity(ReflectancePercent) => -2.0,
            Self::Quantity(_) => 1.0,
        }
    }

    /// Returns the options of angles with this alternative.
    fn angle_args(self, stated: &AngleArgs) -> AngleArgs {
        match self {
            Self::Convention(convention) => stated.toggled(convention),
            Self::Unit(unit) => AngleArgs {
                unit: Some(unit),
                azimuth_unit: stated.azimuth_unit.or(Some(AngleUnit::Degrees)),
                ..stated.clone()
            },
            Self::Quantity(_) => stated.clone(),
        }
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (setting, value) = match self.alternative {
            Alternative::Convention(convention) => ("convention", convention.name()),
            Alternative::Unit(unit) => ("unit", unit.name()),
            Alternative::Quantity(quantity) => ("quantity", quantity.name()),
        };
        let setting = Name(setting);
        let (state, remedy) = if self.is_removed {
            ("without", "remove")
        } else {
            ("with", "give")
        };
        let degree = match self.evidence {
            _ if self.is_refused => "far more",
            evidence if evidence > 0.0 => "more",
            _ => "nearly as much",
        };
        write!(
            f,
            "the readings are {degree} like those of a material {state} {setting} {value}; {remedy} it if the file means that"
        )
    }
}

/// A reading of a file: its row, its sample and its directions.
type Placed = (usize, usize, Angles<f64>);

/// The conversion of a file's rows, and the posterior whose prior judges it.
struct Comparison<'a> {
    conversion: Conversion<'a>,
    samples: &'a [SampleReading],
    posterior: &'a Posterior,
}

impl Doubt {
    /// Finds the alternative whose evidence exceeds its minimum most; None if there is none. Zeros and clipped numbers
    /// do not count; other outliers may be due to the reading.
    pub(super) fn find(
        readings: &Readings,
        outliers: &Outliers,
        posterior: &Posterior,
    ) -> Option<Self> {
        let rows = &readings.rows;
        let placed = rows.readings.iter().zip(&readings.of_rows).enumerate();
        let placed = placed.filter(|(_, (row, sample))| {
            let mut sets = outliers.sets.iter().filter(|set| set.is_excluded);
            let kinds = [OutlierKind::NoLight, OutlierKind::Clipped];
            let is_wrong =
                sets.any(|set| kinds.contains(&set.kind) && set.samples.contains(*sample));
            !row.saturated && !is_wrong
        });
        let placed = placed.map(|(index, (row, sample))| {
            let own = readings.samples[*sample].angles.map(f64::from);
            (index, *sample, row.angles.unwrap_or(own))
        });
        let stated: Vec<Placed> = placed.collect();
        let comparison = Comparison {
            conversion: Conversion::new(rows, &readings.quantity, &readings.pattern()).ok()?,
            samples: &readings.samples,
            posterior,
        };
        let args = &rows.angle_args;
        let mut alternatives = Vec::new();
        // The directions of a recipe's samples are known.
        if readings.noise.is_some() {
            alternatives.extend([
                Alternative::Convention(AngleConvention::Elevation),
                Alternative::Convention(AngleConvention::FromMirror),
                Alternative::Convention(AngleConvention::Exchanged),
            ]);
            alternatives.extend(
                args.unit
                    .is_none()
                    .then_some(Alternative::Unit(AngleUnit::Radians)),
            );
        }
        // A highlight alone may have any magnitude.
        let is_off_highlight = |(_, _, at): &Placed| is_off_highlight(at.map(|angle| angle as f32));
        let mut base = Multiple::Brdf;
        if let ReadingQuantity::Values(multiple, _) = &readings.quantity
            && stated.iter().any(is_off_highlight)
            && rows.cielab.is_none()
        {
            base = *multiple;
            let mut numbers = rows.readings.iter().flat_map(|row| &row.numbers);
            let may_be_encoded =
                rows.wavelengths.is_empty() && numbers.all(|number| *number <= 1.0);
            let others = Multiple::value_variants().iter().copied();
            let others = others
                .filter(|other| *other != base && (*other != Multiple::Srgb || may_be_encoded));
            alternatives.extend(others.map(Alternative::Quantity));
        }
        let has_apertures = readings.samples.iter().any(|one| one.aperture.is_some());
        let doubts = alternatives.into_iter().filter_map(|alternative| {
            let (evidence, count) = comparison.evidence(alternative, &stated)?;
            let excess =
                evidence - alternative.min_evidence(base, has_apertures) - MIN_EVIDENCE / count;
            let doubt = Self {
                alternative,
                evidence,
                is_removed: matches!(alternative, Alternative::Convention(one) if args.has(one)),
                is_refused: excess > REFUSED,
            };
            (excess > 0.0).then_some((excess, doubt))
        });
        let best = doubts.max_by(|(one, _), (other, _)| one.total_cmp(other));
        best.map(|(_, doubt)| doubt)
    }
}

impl Comparison<'_> {
    /// Returns the evidence per reading of an alternative over the stated reading, and the number of compared readings. None if
    /// it cannot be meant, or there are too few.
    fn evidence(&self, alternative: Alternative, stated: &[Placed]) -> Option<(f64, f64)> {
        let mut other = stated.to_vec();
        if !matches!(alternative, Alternative::Quantity(_)) {
            let args = alternative.angle_args(&self.conversion.rows.angle_args);
            let reread = self.conversion.rows.reread(&args)?;
            for ((row, _, angles), stated) in other.iter_mut().zip(stated) {
                *angles = reread[*row].unwrap_or(stated.2);
            }
            if other == stated {
                return None;
            }
        }
        let pairs = stated.iter().zip(&other);
        let pairs = pairs.filter(|pair| is_compared(pair.0.2) && is_compared(pair.1.2));
        let pairs: Vec<_> = pairs.collect();
        let [fewest, most] = READINGS;
        // Gloss has one unit.
        let is_quantity = matches!(alternative, Alternative::Quantity(_));
        let aperture = |sample: usize| self.samples[sample].aperture.as_ref();
        let is_gray = |sample: usize| aperture(sample).is_some_and(|one| one.is_gray);
        let is_changed = |pair: &&(&Placed, &Placed)| !(is_quantity && is_gray(pair.0.1));
        let changed = pairs.iter().filter(is_changed).count();
        let has_apertures = pairs.iter().any(|pair| aperture(pair.0.1).is_some());
        let fewest = if has_apertures { 1 } else { fewest };
        if changed < fewest {
            return None;
        }
        let step = pairs.len().div_ceil(most);
        let (stated, other): (Vec<Placed>, Vec<Placed>) = pairs
            .into_iter()
            .step_by(step)
            .map(|(one, other)| (*one, *other))
            .unzip();
        let quantity = match (alternative, self.conversion.quantity) {
            (Alternative::Quantity(multiple), ReadingQuantity::Values(_, reflectance)) => {
                ReadingQuantity::Values(multiple, *reflectance)
            }
            (_, stated) => stated.clone(),
        };
        let conversion = self.conversion.of(&quantity);
        let ratio = self.density(&conversion, &other)? - self.density(&self.conversion, &stated)?;
        let count = changed.min(stated.len()) as f64;
        Some((ratio / count, count))
    }

    /// Returns the logarithm of the density of the numbers of rows.
    fn density(&self, conversion: &Conversion<'_>, placed: &[Placed]) -> Option<f64> {
        let (mut slopes, mut readings) = (Vec::new(), Vec::new());
        let rows = conversion.rows;
        for (row, sample, angles) in placed {
            let row = &rows.readings[*row];
            let at = to_directions(*angles);
            let convert = |numbers: [f32; 3]| {
                let reading = conversion.to_brdf(row, *sample, &at, numbers);
                reading.ok().map(|reading| reading.brdf)
            };
            let numbers = rows.rgb(row);
            let steps = numbers.map(|number| 1e-2 * number.abs().max(1e-4));
            let [low, high] = [-1.0, 1.0].map(|sign| {
                convert([0, 1, 2].map(|channel: usize| numbers[channel] + sign * steps[channel]))
            });
            let (low, high) = (low?, high?);
            slopes.push([0, 1, 2].map(|channel: usize| {
                f64::from((high[channel] - low[channel]) / (2.0 * steps[channel])).ln()
            }));
            readings.push(PosteriorReading {
                angles: angles.map(|angle| angle as f32),
                aperture: self.samples[*sample].aperture.clone(),
                brdf: convert(numbers)?,
                noise: row
                    .noise
                    .or(rows.noise)
                    .unwrap_or(DEFAULT_NOISE)
                    .max(DEFAULT_NOISE),
            });
        }
        let brdf: Vec<[f32; 3]> = readings.iter().map(|reading| reading.brdf).collect();
        let evidence = Evidence::new(self.posterior, &readings);
        let density = evidence?.log_density(&brdf, &slopes);
        Some(density).filter(|density| density.is_finite())
    }
}

/// Returns true if both directions are away from the horizon.
fn is_compared(angles: Angles<f64>) -> bool {
    let min_cosine = MAX_POLAR.to_radians().cos();
    above_horizon(angles).is_some_and(|angles| {
        let at = HalfDifference::from_angles(angles);
        at.cos_theta_i().min(at.cos_theta_o()) > min_cosine
    })
}

/// Returns true if a reading informs about more than a highlight.
pub(super) fn is_off_highlight(angles: Angles<f32>) -> bool {
    angles.theta_h.to_degrees() > MIN_HALF_ANGLE
}
