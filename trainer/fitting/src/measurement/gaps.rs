//! Gaps of the readings: properties of the material that a fit guesses.

use glimpse_core::geometry::{Angles, HalfDifference};
use serde::Serialize;

use super::fit::MaterialFit;
use super::instrument::Instrument;
use super::next::NextReading;
use super::readings::SampleReading;
use super::spectrum::aspecular;
use crate::route::{MachineArgs, arms_in_degrees};

/// The angle from the mirror direction, in degrees, within which a reading determines gloss. It is below the 15 degrees of
/// multi-angle instruments, which miss a clear coat, by the tolerance of an instrument's arms.
const MAX_GLOSS_ANGLE: f32 = 14.5;
/// Polar angles of mirror directions to read, in degrees.
const GLOSS_ANGLES: [f32; 3] = [20.0, 60.0, 75.0];
/// The largest polar angle in degrees after which extrapolation is reported. Few instruments read beyond it.
const MAX_POLAR: f64 = 85.0;

/// Properties of the material about which the readings state nothing.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Gaps {
    /// The lack of a reading near the mirror direction; None if there is one, or that of a sphere.
    pub gloss: Option<GlossGap>,
    /// True if a sphere alone reads the highlight, so that its width is unknown.
    pub is_width_unknown: bool,
    /// The largest polar angle of light and sensor that was read, in degrees; None if it is 85 or more. Beyond it, the fit
    /// extrapolates.
    pub extrapolated_from: Option<f64>,
    /// True if the readings have one channel, so that the color is unknown.
    pub is_monochrome: bool,
    /// The reading that would reduce the expected loss most; None if no direction is within the machine's limits.
    pub next: Option<NextReading>,
}

/// The lack of a reading near the mirror direction.
#[derive(Clone, Debug, Serialize)]
pub struct GlossGap {
    /// The smallest angle of a used reading from the mirror direction, in degrees.
    pub nearest: f32,
    /// The polar angles of mirror directions to read, theta_i = theta_o in degrees, within the machine's limits.
    pub read: Vec<f32>,
}

impl Gaps {
    /// Finds the gaps of a fit. A learned pattern without missing readings has none, unless there is only one channel.
    pub(super) fn new(fit: &MaterialFit) -> Self {
        let readings = &fit.selection.readings;
        let mut gaps = Self {
            is_monochrome: readings.rows.is_monochrome,
            ..Self::default()
        };
        let used = readings.samples.iter();
        let used = used.filter(|sample| sample.used().is_some());
        let samples: Vec<&SampleReading> = used.collect();
        let mut units = samples.iter().map(|sample| sample.optics.gloss_unit());
        gaps.is_monochrome |= units.all(|unit| unit.is_some());
        let used: Vec<Angles<f32>> = samples.iter().map(|sample| sample.angles).collect();
        if readings.noise.is_none() && used.len() == readings.samples.len() {
            return gaps;
        }
        let (mut polar, mut nearest, mut has_sphere) = (0.0, f32::INFINITY, false);
        for sample in &samples {
            let arms = arms_in_degrees(sample.angles);
            polar = arms.theta_i.max(polar);
            if let Some(Instrument::Sci | Instrument::Sce) = sample.optics.instrument {
                // Its sensor has no direction.
                has_sphere = true;
                continue;
            }
            polar = arms.theta_o.max(polar);
            nearest = nearest.min(aspecular(&HalfDifference::from_angles(sample.angles)).abs());
        }
        gaps.extrapolated_from = Some(polar).filter(|polar| polar.round() < MAX_POLAR);
        let limits = readings.recipe.file.metadata().machine().limits;
        let reach = limits.max_theta_i.min(limits.max_theta_o).to_degrees();
        let read = GLOSS_ANGLES.into_iter().filter(|theta| *theta <= reach);
        let read = read.collect();
        let is_guess = nearest > MAX_GLOSS_ANGLE;
        gaps.is_width_unknown = is_guess && has_sphere;
        gaps.gloss = (is_guess && !has_sphere).then_some(GlossGap { nearest, read });
        let so_far = (&fit.selection.posterior, &used[..]);
        let next = readings.recipe.next(&MachineArgs::default(), so_far, 1);
        let next = next.ok().and_then(|proposals| proposals.first().copied());
        gaps.next = next.map(|proposal| NextReading::new(&proposal, limits.in_plane, false));
        gaps
    }
}
