//! The coefficient net and the start net for a batch of materials on lanes, one material per lane, and their adjoint.

use glimpse_core::fit::coefficient_net::{CoefficientNetGradient, Input, StartNetGradient};

use crate::completion_weights::split_lists_mut;
pub use crate::completion_weights::{CompletionWeights, Shape, split_lists};
use crate::lanes::{InstructionSet, Lanes, MAX_OCTETS, Octet, WIDTH, add_totals, kernel};

/// A list of numbers for each material of a batch.
///
/// Each lane of an octet belongs to one material. The octets of the first eight materials are followed by those of the
/// next eight, and so on.
#[derive(Clone, Debug)]
struct Lists {
    /// The number of entries of a list.
    length: usize,
    octets: Vec<Octet>,
}

impl Lists {
    /// Creates lists of zeros for a given number of octets of materials.
    fn zeros(length: usize, octets: usize) -> Self {
        Self {
            length,
            octets: vec![Octet::default(); length * octets],
        }
    }

    /// Returns an entry of a material.
    fn set(
        &mut self,
        material: usize,
        entries: impl Iterator<Item = usize>,
        values: impl IntoIterator<Item = f32>,
    ) {
        let octets = &mut self.octets[material / WIDTH * self.length..];
        for (entry, value) in entries.zip(values) {
            octets[entry].0[material % WIDTH] = value;
        }
    }

    /// Returns entries of a material.
    fn get(&self, material: usize, entries: impl Iterator<Item = usize>) -> Vec<f32> {
        let octets = &self.octets[material / WIDTH * self.length..];
        entries
            .map(|entry| octets[entry].0[material % WIDTH])
            .collect()
    }

    /// Loads the lists of the materials on the lanes, from octet `first` of `octets` on. Lanes past the end repeat the
    /// last octet.
    #[inline(always)]
    fn load<L: Lanes>(&self, first: usize, octets: usize, list: &mut [L]) {
        for (entry, value) in list.iter_mut().enumerate() {
            let mut sources = [&self.octets[first * self.length + entry]; MAX_OCTETS];
            for (k, source) in sources.iter_mut().enumerate().take(L::OCTETS) {
                *source = &self.octets[(first + k).min(octets - 1) * self.length + entry];
            }
            *value = L::load(sources);
        }
    }

    /// Stores what [`load`](Self::load) loads, without the lanes past the end.
    #[inline(always)]
    fn store<L: Lanes>(&mut self, first: usize, octets: usize, list: &[L]) {
        for (entry, value) in list.iter().enumerate() {
            let mut stored = [Octet::default(); MAX_OCTETS];
            value.store(&mut stored);
            let count = L::OCTETS.min(octets - first);
            for (k, octet) in stored.iter().enumerate().take(count) {
                self.octets[(first + k) * self.length + entry] = *octet;
            }
        }
    }
}

/// Readings of a batch of materials, and the outputs of both nets. `by_x` is the gradient of the loss with respect to x.
#[derive(Clone, Debug)]
pub struct Batch {
    shape: Shape,
    /// The number of octets of materials.
    octets: usize,
    /// The readings, sample by sample: three channels, and 1 if the reading is missing.
    inputs: Lists,
    by_inputs: Lists,
    /// The coefficient net's state.
    state: Lists,
    by_state: Lists,
    /// The start net's hidden units, and its offset of each parameter.
    units: Lists,
    offsets: Lists,
    by_offsets: Lists,
}

impl Batch {
    /// Creates a batch of a given number of materials, filled with zeros.
    #[must_use]
    pub fn new(shape: Shape, materials: usize) -> Self {
        let octets = materials.div_ceil(WIDTH);
        let lists = |length: usize| Lists::zeros(length, octets);
        Self {
            shape,
            octets,
            inputs: lists(INPUTS * shape.samples),
            by_inputs: lists(3 * shape.samples),
            state: lists(shape.state_len()),
            by_state: lists(shape.state_len()),
            units: lists(shape.units),
            offsets: lists(shape.parameters),
            by_offsets: lists(shape.parameters),
        }
    }

    /// Sets a material's reading of a sample: its standardized channels, or None if it is
    /// missing.
    pub fn set_reading(&mut self, material: usize, sample: usize, reading: Option<[f32; 3]>) {
        let [red, green, blue] = reading.unwrap_or_default();
        let missing = if reading.is_some() { 0.0 } else { 1.0 };
        let entries = INPUTS * sample..INPUTS * (sample + 1);
        self.inputs
            .set(material, entries, [red, green, blue, missing]);
    }

    /// Returns the gradient with respect to a material's reading of a sample.
    #[must_use]
    pub fn by_reading(&self, material: usize, sample: usize) -> [f32; 3] {
        let (octet, lane) = (material / WIDTH, material % WIDTH);
        let (by_inputs, _) = self.by_inputs.octets.as_chunks::<3>();
        by_inputs[octet * self.shape.samples + sample].map(|octet| octet.0[lane])
    }

    /// Returns the entries of the coefficients in the state: those of red, then of green, then of blue.
    fn coefficient_entries(&self) -> impl Iterator<Item = usize> + use<> {
        let (rows, components) = (self.shape.rows(), self.shape.components);
        (0..3).flat_map(move |channel| channel * rows..channel * rows + components)
    }

    /// Returns the coefficients of a material: those of red, then of green, then of blue.
    #[must_use]
    pub fn coefficients(&self, material: usize) -> Vec<f32> {
        self.state.get(material, self.coefficient_entries())
    }

    /// Replaces the coefficients of a material: those of red, then of green, then of blue.
    pub fn set_coefficients(&mut self, material: usize, coefficients: &[f32]) {
        let entries = self.coefficient_entries();
        self.state
            .set(material, entries, coefficients.iter().copied());
    }

    /// Returns the gradient with respect to a material's coefficients.
    #[must_use]
    pub fn coefficient_gradient(&self, material: usize) -> Vec<f32> {
        self.by_state.get(material, self.coefficient_entries())
    }

    /// Sets the gradient with respect to a material's coefficients.
    pub fn set_coefficient_gradient(&mut self, material: usize, by_coefficients: &[f32]) {
        let entries = self.coefficient_entries();
        self.by_state
            .set(material, entries, by_coefficients.iter().copied());
    }

    /// Returns the start net's offsets of a material's initial parameters.
    #[must_use]
    pub fn offsets(&self, material: usize) -> Vec<f32> {
        self.offsets.get(material, 0..self.shape.parameters)
    }

    /// Sets the gradient with respect to a material's initial parameters.
    pub fn set_offset_gradient(
        &mut self,
        material: usize,
        by_offsets: impl IntoIterator<Item = f32>,
    ) {
        let entries = 0..self.shape.parameters;
        self.by_offsets.set(material, entries, by_offsets);
    }

    /// Loads the inputs of all samples, as [`Lists::load`] does.
    #[inline(always)]
    fn load_inputs<L: Lanes>(&self, first: usize, flat: &mut [L], inputs: &mut Vec<Input<L>>) {
        self.inputs.load(first, self.octets, flat);
        inputs.clear();
        for [red, green, blue, missing] in flat.as_chunks::<INPUTS>().0 {
            inputs.push(Input {
                channels: [*red, *green, *blue],
                missing: *missing,
            });
        }
    }
}

/// The number of inputs of a sample.
const INPUTS: usize = 4;

kernel! {
    on InstructionSet::detect();
    /// Computes the coefficients of a batch from the readings.
    pub fn complete<'a, L: Lanes>(batch: &'a mut Batch, weights: &'a CompletionWeights<'a>) {
        let (shape, octets) = (batch.shape, batch.octets);
        let coefficient_net = weights.coefficient_net::<L>();
        let mut flat = vec![L::constant(0.0); batch.inputs.length];
        let mut inputs = Vec::with_capacity(shape.samples);
        let mut state = vec![L::constant(0.0); shape.state_len()];
        for first in (0..octets).step_by(L::OCTETS) {
            batch.load_inputs(first, &mut flat, &mut inputs);
            coefficient_net.compute(&inputs, &mut state);
            batch.state.store(first, octets, &state);
        }
    }
}

kernel! {
    on InstructionSet::detect();
    /// Computes the offsets of the initial parameters from the coefficients.
    pub fn activate<'a, L: Lanes>(batch: &'a mut Batch, weights: &'a CompletionWeights<'a>) {
        let (shape, octets) = (batch.shape, batch.octets);
        let coefficient_net = weights.coefficient_net::<L>();
        let start_net = weights.start_net::<L>();
        let mut state = vec![L::constant(0.0); shape.state_len()];
        let mut units = vec![L::constant(0.0); shape.units];
        let mut offsets = vec![L::constant(0.0); shape.parameters];
        for first in (0..octets).step_by(L::OCTETS) {
            batch.state.load(first, octets, &mut state);
            start_net.activate(coefficient_net.coefficients(&state), &mut units);
            for (parameter, offset) in offsets.iter_mut().enumerate() {
                *offset = start_net.offset(parameter, &units);
            }
            batch.units.store(first, octets, &units);
            batch.offsets.store(first, octets, &offsets);
        }
    }
}

/// Multiplies a list from octet `first` on by 0 in lanes that repeat the last octet.
#[inline(always)]
fn drop_repeated<L: Lanes>(first: usize, octets: usize, list: &mut [L]) {
    let mut valid = [Octet([1.0; WIDTH]); MAX_OCTETS];
    for (k, octet) in valid.iter_mut().enumerate() {
        *octet = Octet([if first + k < octets { 1.0 } else { 0.0 }; WIDTH]);
    }
    let valid = L::load(valid.each_ref());
    for value in list {
        *value = *value * valid;
    }
}

kernel! {
    on InstructionSet::detect();
    /// Propagates the gradients with respect to initial parameters backwards. Adds the gradient with respect to the start
    /// net's weights to the argument, and that with respect to the coefficients to the gradient of these.
    pub fn start_net_adjoint<'a, L: Lanes>(
        batch: &'a mut Batch,
        weights: &'a CompletionWeights<'a>,
        by_start_net: &'a mut [f32],
    ) {
        let (shape, octets, rows) = (batch.shape, batch.octets, batch.shape.rows());
        let coefficient_net = weights.coefficient_net::<L>();
        let mut state = vec![L::constant(0.0); shape.state_len()];
        let mut by_state = state.clone();
        let mut units = vec![L::constant(0.0); shape.units];
        let mut by_units = units.clone();
        let mut by_offsets = vec![L::constant(0.0); shape.parameters];
        let mut sums = vec![L::zero_sum(); by_start_net.len()];
        for first in (0..octets).step_by(L::OCTETS) {
            batch.state.load(first, octets, &mut state);
            batch.by_state.load(first, octets, &mut by_state);
            batch.units.load(first, octets, &mut units);
            batch.by_offsets.load(first, octets, &mut by_offsets);
            drop_repeated(first, octets, &mut by_offsets);
            let [hidden, bias, output] = split_lists_mut(&mut sums, shape.start_net_lengths());
            let mut gradient = StartNetGradient {
                hidden,
                bias,
                output,
            };
            let (red, rest) = by_state.split_at_mut(rows);
            let (green, blue) = rest.split_at_mut(rows);
            let by_coefficients = [red, green, blue].map(|list| &mut list[..shape.components]);
            weights.start_net::<L>().adjoint(
                coefficient_net.coefficients(&state),
                &units,
                &by_offsets,
                &mut by_units,
                &mut gradient,
                by_coefficients,
            );
            batch.by_state.store(first, octets, &by_state);
        }
        add_totals::<L>(&sums, by_start_net);
    }
}

kernel! {
    on InstructionSet::detect();
    /// Propagates the gradients with respect to coefficients backwards. Adds the gradient with respect to the coefficient
    /// net's weights to the argument, and stores that with respect to the readings.
    pub fn coefficient_net_adjoint<'a, L: Lanes>(
        batch: &'a mut Batch,
        weights: &'a CompletionWeights<'a>,
        by_coefficient_net: &'a mut [f32],
    ) {
        let (shape, octets) = (batch.shape, batch.octets);
        let coefficient_net = weights.coefficient_net::<L>();
        let mut flat = vec![L::constant(0.0); batch.inputs.length];
        let mut inputs = Vec::with_capacity(shape.samples);
        let mut state = vec![L::constant(0.0); shape.state_len()];
        let mut by_state = state.clone();
        let mut by_inputs = vec![[L::constant(0.0); 3]; shape.samples];
        let mut sums = vec![L::zero_sum(); by_coefficient_net.len()];
        for first in (0..octets).step_by(L::OCTETS) {
            batch.load_inputs(first, &mut flat, &mut inputs);
            batch.state.load(first, octets, &mut state);
            batch.by_state.load(first, octets, &mut by_state);
            drop_repeated(first, octets, &mut by_state);
            let [readings, bias, output] =
                split_lists_mut(&mut sums, shape.coefficient_net_lengths());
            let mut gradient = CoefficientNetGradient {
                readings,
                bias,
                output,
            };
            coefficient_net.adjoint(
                &inputs,
                &state,
                &mut by_state,
                &mut gradient,
                &mut by_inputs,
            );
            batch.by_inputs.store(first, octets, by_inputs.as_flattened());
        }
        add_totals::<L>(&sums, by_coefficient_net);
    }
}
