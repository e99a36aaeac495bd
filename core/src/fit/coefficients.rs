//! The stages net and ridge: from readings to coefficients of principal components, in slices of work.
//!
//! The reading y of a channel at sample i is mapped to u_i = ln((y w + e) / e) - center_i, with w = cos(theta_i)
//! cos(theta_o). The [net](super::coefficient_net) computes a from all u; without a net, a is 0. The
//! [ridge](super::ridge) stage adds z = argmin |t - Q z|^2 + sum over k of p_k z_k^2, with t_i = u_i - (Q a)_i.
//!
//! With a second list of precisions, the mean of the three channels' t is solved with the first list, and their
//! differences from the mean with the second one.

use core::ops::Range;

use super::coefficient_net::{CHANNELS, CoefficientNet, Input, Packed, channels, dropout_gain};
use super::ridge::{System, factor_length, order, scratch_length};
use super::work;
use crate::geometry::HalfDifference;
use crate::model::linear::{map, unmap};
use crate::model::{Sample, Samples};
use crate::numeric::{ComponentRows, Floats, PackedRows, Rows, split};
use crate::section::{MAX_PRECISION, MIN_PRECISION, section};

section! {
    /// A Gaussian prior of the coefficients, and the components at the sampled directions.
    Ridge<'a> = 2, "ridge" {
        /// p, of the mean of the channels
        precision: Floats<'a>, [Components], in MIN_PRECISION => MAX_PRECISION;
        /// p of the differences from that mean; empty if they are the same
        difference_precision: Floats<'a>, [Components], optional true, in MIN_PRECISION => MAX_PRECISION;
        /// mapped mean at each sample. With the paper's mapping, the mapped median is added
        center: Floats<'a>, [Samples], in -100.0 => 100.0;
        /// Q, a row for each sample
        rows: PackedRows<'a>, [Samples, Components], in -1e4 => 1e4;
        /// checksum of the host's basis; 0 for none
        basis_checksum: u32;
    }
}

section! {
    /// The noise of readings, of the coefficients' Gaussian posterior.
    Noise<'a> = 6, "noise" {
        /// variance of u for a scale of 1
        variance: f32, in f32::MIN_POSITIVE => 1e4;
        /// s, the standard deviation of the noise for a scale of 1, over that of each reading; empty if all are 1
        scales: Floats<'a>, [Samples], optional true, in 0.0 => 1.0;
    }
}

section! {
    /// A learned map from readings to the first m coefficients of each channel.
    Net<'a> = 3, "net" {
        /// constant term of each row
        bias: Floats<'a>, [Rows];
        /// m, at most K
        components: u16, in 1.0 => 96.0;
        /// 0 if a fit needs all readings; 2 if it tolerates missing ones; 1 is invalid
        missing: u8, in 0.0 => 2.0;
        /// factor of the mapped readings
        scale: f32, in f32::MIN_POSITIVE => f32::MAX;
        /// for each sample three lists: own, mean, missing
        readings: &'a [u8], [Samples, Three, Rows];
        /// scale of each row of these lists
        reading_scales: Floats<'a>, [Rows];
        /// W
        output: &'a [u8], [Coefficients, Hidden];
        /// scale of each row of W
        output_scales: Floats<'a>, [Coefficients];
    }
}

impl<'a> Net<'a> {
    /// The net's weights.
    #[must_use]
    pub fn weights(&self) -> CoefficientNet<'a, f32, Packed> {
        CoefficientNet {
            components: usize::from(self.components),
            readings: self.readings,
            scales: self.reading_scales.words(),
            bias: self.bias.words(),
            output: self.output,
            output_scales: self.output_scales.words(),
        }
    }

    /// Adds the reading of a sample, or that it is missing.
    #[inline(never)]
    fn add(&self, index: usize, center: Floats<'_>, samples: Samples<'_>, state: &mut [f32]) {
        let Some(sample) = samples.get(index) else {
            return;
        };
        let present = samples.iter().map(|sample| is_present(&sample));
        let scale = self.scale * dropout_gain(self.missing != 0, present);
        let is_missing = !is_present(&sample);
        let input = Input {
            channels: match is_missing {
                true => [0.0; CHANNELS],
                false => mapped(&sample, center.get(index)).map(|u| u * scale),
            },
            missing: f32::from(u8::from(is_missing)),
        };
        self.weights().add(index, &input, state);
    }
}

/// Returns true if a sample has a reading that counts; otherwise it is missing.
fn is_present(sample: &Sample<f32>) -> bool {
    sample.weight > 0.0
}

/// Returns u of each channel.
fn mapped(sample: &Sample<f32>, center: f32) -> [f32; CHANNELS] {
    let weight = sample.at.cos_theta_i() * sample.at.cos_theta_o();
    sample.measured.map(|y| map(y, weight) - center)
}

/// The stages net and ridge of a recipe.
#[derive(Clone, Copy, Debug)]
pub struct Coefficients<'a> {
    /// The first stage, if the recipe has it.
    pub net: Option<Net<'a>>,
    /// The second stage.
    pub ridge: Ridge<'a>,
    /// The noise of readings, if the recipe states it.
    pub noise: Option<Noise<'a>>,
}

/// The kinds of units of work.
#[derive(Clone, Copy)]
enum Unit {
    /// The net adds a reading.
    Add,
    /// The net computes its hidden units.
    Activate,
    /// The net computes the coefficients of a channel.
    Complete,
    /// t of a reading.
    Target,
    /// A row of the system of the channels' mean.
    FactorizeMean,
    SolveMean,
    /// A row of the system of the channels, or of their differences from the mean.
    Factorize,
    /// The solve of a channel.
    Solve,
}

/// The memory, split into its parts.
struct Parts<'w> {
    /// Three lists of K.
    coefficients: &'w mut [f32],
    /// The sum of |t|, each times its weight.
    innovation: &'w mut f32,
    /// The lists of the net.
    net: &'w mut [f32],
    /// t of each channel, and of their mean if it has precisions of its own: lists of n.
    targets: &'w mut [f32],
    /// s, n.
    scales: &'w mut [f32],
    factors: &'w mut [f32],
    /// z, K.
    z: &'w mut [f32],
    scratch: &'w mut [f32],
}

impl<'a> Coefficients<'a> {
    /// K, the number of coefficients of a channel.
    #[must_use]
    pub fn components(&self) -> usize {
        self.ridge.precision.len()
    }

    /// Q.
    #[must_use]
    pub fn rows(&self) -> ComponentRows<'a> {
        self.ridge.rows.of(self.components())
    }

    /// Returns true if the channels' mean has precisions of its own.
    fn has_mean(&self) -> bool {
        !self.ridge.difference_precision.is_empty()
    }

    /// The precisions of the channels, or of their differences from the mean.
    fn channel_precision(&self) -> Floats<'a> {
        match self.has_mean() {
            true => self.ridge.difference_precision,
            false => self.ridge.precision,
        }
    }

    /// The lengths of the parts of the memory.
    fn lengths(&self, samples: usize) -> [usize; 8] {
        let components = self.components();
        [
            components.saturating_mul(CHANNELS),
            1,
            self.net.map_or(0, |net| net.weights().words()),
            samples.saturating_mul(CHANNELS.saturating_add(self.has_mean().into())),
            samples,
            factor_length(samples, components),
            components,
            scratch_length(samples, components),
        ]
    }

    /// The memory in words.
    pub(super) fn words(&self, samples: usize) -> usize {
        let lengths = self.lengths(samples).into_iter();
        lengths.fold(0, usize::saturating_add)
    }

    fn split<'w>(&self, words: &'w mut [f32], samples: usize) -> Option<Parts<'w>> {
        let mut parts = split(words, self.lengths(samples))?.into_iter();
        Some(Parts {
            coefficients: parts.next()?,
            innovation: parts.next()?.first_mut()?,
            net: parts.next()?,
            targets: parts.next()?,
            scales: parts.next()?,
            factors: parts.next()?,
            z: parts.next()?,
            scratch: parts.next()?,
        })
    }

    /// The kinds of units in their order, each with its number.
    fn work(&self, samples: usize) -> [(Unit, usize); 8] {
        let rows = order(samples, self.components());
        let of_net = |units| self.net.map_or(0, |_| units);
        let of_mean = |units| if self.has_mean() { units } else { 0 };
        [
            (Unit::Add, of_net(samples)),
            (Unit::Activate, of_net(1)),
            (Unit::Complete, of_net(CHANNELS)),
            (Unit::Target, samples),
            (Unit::FactorizeMean, of_mean(rows)),
            (Unit::SolveMean, of_mean(1)),
            (Unit::Factorize, rows),
            (Unit::Solve, CHANNELS),
        ]
    }

    /// The number of units of work.
    pub(super) fn units(&self, samples: usize) -> u32 {
        work::total(self.work(samples).into_iter())
    }

    /// The coefficients of each channel, in the memory of these stages.
    pub(super) fn coefficients<'w>(&self, words: &'w [f32]) -> [&'w [f32]; CHANNELS] {
        let components = self.components();
        channels(words, components, components)
    }

    /// The innovation, in the memory of these stages: the mean of |t| over present readings and channels.
    pub(super) fn innovation(&self, words: &[f32]) -> f32 {
        let index = self.components().saturating_mul(CHANNELS);
        words.get(index).copied().unwrap_or(f32::NAN)
    }

    /// Does units of work. `words` are 0 before the first one. Not inlined, so that its stack is released between slices.
    #[inline(never)]
    pub(super) fn advance(&self, units: Range<u32>, samples: Samples<'_>, words: &mut [f32]) {
        let Some(mut parts) = self.split(words, samples.len()) else {
            return;
        };
        let parts = &mut parts;
        let (mean, channels) = (self.ridge.precision, self.channel_precision());
        let work = self.work(samples.len());
        work::advance(work.into_iter(), units, |unit, index, _| {
            match (unit, self.net) {
                (Unit::Add, Some(net)) => net.add(index, self.ridge.center, samples, parts.net),
                (Unit::Activate, Some(net)) => net.weights().activate(parts.net),
                (Unit::Complete, Some(net)) => net.weights().complete(index, parts.net),
                (Unit::Target, _) => self.set_target(index, samples, parts),
                (Unit::FactorizeMean, _) => self.factorize(index, mean, parts),
                (Unit::SolveMean, _) => self.solve(CHANNELS, mean, parts),
                (Unit::Factorize, _) => self.factorize(index, channels, parts),
                (Unit::Solve, _) => self.solve(index, channels, parts),
                (_, None) => {}
            }
        });
    }

    /// Computes t of a sample.
    #[inline(never)]
    fn set_target(&self, index: usize, samples: Samples<'_>, parts: &mut Parts<'_>) {
        let components = self.components();
        if let (0, Some(net)) = (index, &self.net) {
            let lists = parts.coefficients.chunks_exact_mut(components.max(1));
            let net = net.weights();
            for (list, initial) in lists.zip(net.coefficients(parts.net)) {
                for (coefficient, initial) in list.iter_mut().zip(initial) {
                    *coefficient = *initial;
                }
            }
        }
        let Some(sample) = samples.get(index).filter(is_present) else {
            return;
        };
        let mut t = mapped(&sample, self.ridge.center.get(index));
        for (t, coefficients) in t.iter_mut().zip(self.coefficients(parts.coefficients)) {
            *t -= self.rows().dot(index, coefficients);
            *parts.innovation += t.abs() * sample.weight;
        }
        let [red, green, blue] = t;
        let mean = match self.has_mean() {
            true => (red + green + blue) * (1.0 / 3.0),
            false => 0.0,
        };
        let lists = parts.targets.chunks_exact_mut(parts.scales.len().max(1));
        let values = [red - mean, green - mean, blue - mean, mean];
        for (list, value) in lists.zip(values) {
            if let Some(target) = list.get_mut(index) {
                *target = value;
            }
        }
        if let Some(scale) = parts.scales.get_mut(index) {
            let scales = self.noise.map(|noise| noise.scales);
            let scales = scales.filter(|scales| !scales.is_empty());
            *scale = scales.map_or(1.0, |scales| scales.get(index));
        }
    }

    fn system<'s>(
        &'s self,
        precision: Floats<'s>,
        scales: &'s [f32],
    ) -> System<'s, f32, [u8; 4], ComponentRows<'s>> {
        System {
            rows: self.rows(),
            scales,
            precision: precision.words(),
        }
    }

    #[inline(never)]
    fn factorize(&self, row: usize, precision: Floats<'_>, parts: &mut Parts<'_>) {
        let system = self.system(precision, parts.scales);
        system.factorize_row(row, parts.factors, parts.z);
    }

    /// Solves for z of a list of targets, and adds it to the coefficients of its channel, or of all channels.
    #[inline(never)]
    fn solve(&self, list: usize, precision: Floats<'_>, parts: &mut Parts<'_>) {
        let mut targets = parts.targets.chunks_exact(parts.scales.len().max(1));
        let targets = targets.nth(list).unwrap_or_default();
        let system = self.system(precision, parts.scales);
        system.solve(parts.factors, targets, parts.z, parts.scratch);
        let lists = parts
            .coefficients
            .chunks_exact_mut(self.components().max(1));
        for (channel, coefficients) in lists.enumerate() {
            if list == channel || list == CHANNELS {
                for (coefficient, z) in coefficients.iter_mut().zip(&*parts.z) {
                    *coefficient += z;
                }
            }
        }
    }
}

/// Returns the BRDF (sr^-1, not times the cosine) of coefficients at a direction, which has an index in `rows` and
/// `centers`: that of its center plus the sum of the components there times their coefficients.
///
/// Not inlined, so that firmware contains it once and its stack is released afterwards.
#[inline(never)]
pub(super) fn brdf_at(
    rows: ComponentRows<'_>,
    centers: Floats<'_>,
    index: usize,
    at: &HalfDifference<f32>,
    coefficients: [&[f32]; CHANNELS],
) -> [f32; CHANNELS] {
    let center = centers.get(index);
    let weight = at.cos_theta_i() * at.cos_theta_o();
    coefficients.map(|coefficients| unmap(center + rows.dot(index, coefficients), weight))
}
