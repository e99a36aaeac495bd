//! Detection of outliers: readings that are improbable, given the other readings.
//!
//! The posterior of the coefficients from the other readings predicts each one, and each group of readings that may be wrong
//! for one reason: wrong neighbors predict each other, but the others do not predict them. A wrong group distorts the
//! predictions of the others, but is itself furthest from its prediction. So the furthest one is removed, and the others are
//! predicted again.
//!
//! A reading of an unusual material is improbable, too, but it helps to predict the others. Only the worst single outlier is
//! excluded from the fit, and what an instrument causes, and only if the others predict each other better without it.

use clap::ValueEnum;
use glimpse_materials::lists::dot;
use serde::Serialize;

use crate::linear::{Posterior, gain_without};
use crate::route::relative_arms;

use super::readings::SampleReading;

/// The minimum number of readings per outlier. With fewer others, predictions are unreliable.
const READINGS_PER_OUTLIER: usize = 4;
/// The largest number of sets of outliers.
const MAX_OUTLIERS: usize = 16;
/// The largest angles between the directions of a group's readings and of its center, in degrees.
const RADII: [f32; 2] = [5.5, 10.5];
/// Angles between lamp and sensor within which they may be in each other's way, in degrees.
const OBSTRUCTED: [f32; 3] = [4.5, 8.5, 12.5];
/// The largest reading without light, relative to the median of the readings.
const DARK: f32 = 1e-3;
/// The z-score above which readings have one of the causes of an instrument.
const INSTRUMENT_THRESHOLD: f64 = 3.0;
/// The gain above which they are excluded from the fit.
const MIN_INSTRUMENT_GAIN: f64 = 0.5;
/// The gain above which the worst single reading is excluded: an eighth for each reading, up to 15. A right reading of a narrow
/// highlight has a gain, too. Chosen for lines on networks of MERL.
const GAIN_PER_READING: f64 = 0.125;
const MAX_GAIN: f64 = 15.0;
/// The number of readings for each excluded one at the largest value. If there are more, the others do not determine the
/// highlight, and a fit with all is better.
const READINGS_PER_CLIPPED: usize = 12;

/// Returns the z-score above which one of k readings is an outlier: sqrt(3 + 2 ln k). The largest of k standard normal
/// numbers is about sqrt(2 ln k), so the rate of false positives does not increase with k. The constant 3 was chosen on
/// procedural materials: with 1, a tenth of correct scans of eight readings has an outlier. That of neighbors is 9, because
/// there are more groups of them.
fn outlier_threshold(kind: OutlierKind, readings: usize) -> f64 {
    let constant = match kind {
        OutlierKind::Single => 3.0,
        OutlierKind::Neighbors => 9.0,
        OutlierKind::Obstructed | OutlierKind::NoLight => return INSTRUMENT_THRESHOLD,
        // Equal numbers are the evidence.
        OutlierKind::Clipped => return 0.0,
    };
    f64::sqrt(constant + 2.0 * (readings.max(1) as f64).ln())
}

/// The likely cause of outliers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum OutlierKind {
    /// A single reading.
    Single,
    /// Several readings of neighboring directions.
    Neighbors,
    /// Readings where lamp and sensor are in each other's way.
    Obstructed,
    /// Readings of 0, where the others predict light.
    NoLight,
    /// Readings whose numbers are cut off at the largest value.
    Clipped,
}

/// Samples that are outliers for one reason.
#[derive(Clone, Debug)]
pub struct OutlierSet {
    /// The likely cause.
    pub kind: OutlierKind,
    /// The samples.
    pub samples: Vec<usize>,
    /// The mean of the readings minus their predictions, in standard deviations.
    pub z: f64,
    /// The magnitude of z above which readings are outliers for this reason.
    pub threshold: f64,
    /// True if a fit is better without them.
    pub is_excluded: bool,
}

/// The outliers among the readings of samples.
#[derive(Clone, Debug, Default)]
pub struct Outliers {
    /// The sets of outliers, in the order of their detection: clipped ones, and then the worst first.
    pub sets: Vec<OutlierSet>,
}

/// Returns candidates for outliers: their likely cause, and the indices of the readings. Those of single readings are first.
fn candidates(readings: &[&SampleReading]) -> Vec<(OutlierKind, Vec<usize>)> {
    let light = readings.iter().map(|one| one.brdf.mean.iter().sum::<f32>());
    let light: Vec<f32> = light.collect();
    let mut sorted = light.clone();
    sorted.sort_by(f32::total_cmp);
    let dark = DARK * sorted.get(sorted.len() / 2).copied().unwrap_or_default();
    let is_dark = |index: usize| light[index] <= dark;
    let mut candidates = Vec::new();
    let mut add = |kind, holds: &dyn Fn(usize) -> bool| {
        let group: Vec<usize> = (0..readings.len()).filter(|one| holds(*one)).collect();
        let all_dark = group.iter().all(|one| is_dark(*one));
        let kind = if all_dark { OutlierKind::NoLight } else { kind };
        candidates.push((kind, group));
    };
    for index in 0..readings.len() {
        add(OutlierKind::Single, &|other| other == index);
    }
    add(OutlierKind::Clipped, &|index| readings[index].is_clipped);
    add(OutlierKind::NoLight, &is_dark);
    for angle in OBSTRUCTED {
        let near = |index: usize| 2.0 * readings[index].angles.theta_d.to_degrees() <= angle;
        add(OutlierKind::NoLight, &|index| near(index) && is_dark(index));
        add(OutlierKind::Obstructed, &near);
    }
    let directions = readings.iter().map(|reading| {
        let arms = relative_arms(reading.angles);
        arms.map(|angle| angle.to_radians() as f32).directions()
    });
    let directions: Vec<_> = directions.collect();
    for radius in RADII {
        let within = |one: usize, other: usize, radius: f32| {
            let near =
                |one: [f32; 3], other: [f32; 3]| dot(&one, &other) >= radius.to_radians().cos();
            let (one_at, other_at) = (&directions[one], &directions[other]);
            is_dark(one) == is_dark(other)
                && near(one_at.incoming, other_at.incoming)
                && near(one_at.outgoing, other_at.outgoing)
        };
        let mut centers: Vec<usize> = Vec::new();
        for index in 0..readings.len() {
            let is_near = |center: &usize| within(*center, index, radius / 3.0);
            if !centers.iter().any(is_near) {
                centers.push(index);
                add(OutlierKind::Neighbors, &|one| within(index, one, radius));
            }
        }
    }
    candidates
}

impl Outliers {
    /// Finds outliers among the samples of a posterior's readings, and stores the prediction of each reading from the others.
    #[must_use]
    pub fn find(mut posterior: Posterior, known: &[usize], readings: &mut [SampleReading]) -> Self {
        let count = known.len();
        let of_known = known.iter().map(|sample| &readings[*sample]);
        let mut candidates = candidates(&of_known.collect::<Vec<_>>());
        let mut outliers = Self::default();
        // Three numbers of displays may contradict each other, too.
        let has_apertures = known
            .iter()
            .any(|sample| readings[*sample].aperture.is_some());
        let min_allowed = usize::from(has_apertures && count > 2);
        let mut allowed = (count / READINGS_PER_OUTLIER).max(min_allowed);
        let mut left_out = Vec::new();
        loop {
            let groups = candidates.iter().map(|(_, group)| group.as_slice());
            let mut predicted = posterior.left_out(&groups.collect::<Vec<_>>());
            for (sample, prediction) in known.iter().zip(&predicted) {
                let prediction = prediction.as_ref().and_then(|group| group.first());
                let sample = &mut readings[*sample];
                sample.prediction = prediction.copied().or(sample.prediction);
            }
            if let Some((set, earlier)) = outliers.sets.split_last_mut() {
                let gain = gain_without(&left_out, &predicted[..count]);
                let min_gain = (GAIN_PER_READING * count as f64).min(MAX_GAIN);
                set.is_excluded = match set.kind {
                    OutlierKind::Clipped => {
                        set.z < 0.0 && READINGS_PER_CLIPPED * set.samples.len() <= count
                    }
                    OutlierKind::NoLight | OutlierKind::Obstructed => gain > MIN_INSTRUMENT_GAIN,
                    // Right neighbors of unusual materials are as improbable.
                    OutlierKind::Neighbors => false,
                    kind @ OutlierKind::Single => {
                        gain > min_gain
                            && count >= READINGS_PER_OUTLIER
                            && earlier.iter().all(|set| set.kind != kind)
                    }
                };
                // The gain of a set is too small while others of the same cause remain.
                for other in earlier.iter_mut().filter(|other| other.kind == set.kind) {
                    other.is_excluded |= set.is_excluded;
                }
            }
            let excess = |index: usize| {
                let (kind, ref group) = candidates[index];
                let z = predicted[index].as_ref()?[0].z;
                let excess = match kind {
                    OutlierKind::Clipped => f64::INFINITY,
                    OutlierKind::NoLight if z > 0.0 => return None,
                    _ => z.powi(2) - outlier_threshold(kind, count).powi(2),
                };
                let is_possible = group.len() <= allowed || kind == OutlierKind::Clipped;
                (is_possible && excess > 0.0).then_some((index, excess))
            };
            let worst = (0..candidates.len()).filter_map(excess);
            let worst = worst.max_by(|one, other| one.1.total_cmp(&other.1));
            let Some((worst, _)) = worst.filter(|_| outliers.sets.len() < MAX_OUTLIERS) else {
                return outliers;
            };
            let (kind, group) = candidates[worst].clone();
            let Some(prediction) = predicted[worst].take() else {
                return outliers;
            };
            // The rest of many clipped readings does not determine the others.
            if kind != OutlierKind::Clipped || READINGS_PER_CLIPPED * group.len() <= count {
                let Some(others) = posterior.without(&group) else {
                    return outliers;
                };
                posterior = others;
                allowed = allowed.saturating_sub(group.len());
            }
            for (index, prediction) in group.iter().zip(&prediction) {
                readings[known[*index]].prediction = Some(*prediction);
            }
            for (_, candidate) in &mut candidates {
                candidate.retain(|index| !group.contains(index));
            }
            outliers.sets.push(OutlierSet {
                kind,
                samples: group.iter().map(|index| known[*index]).collect(),
                z: prediction[0].z,
                threshold: outlier_threshold(kind, count),
                is_excluded: false,
            });
            predicted.truncate(count);
            left_out = predicted;
        }
    }
}
