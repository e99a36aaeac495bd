//! The coefficient net and the start net for a batch of materials on lanes, one material per lane, and their adjoint.

use glimpse_core::fit::coefficient_net::{CoefficientNetGradient, Input, StartNetGradient};

use crate::completion_weights::split_lists_mut;
pub use crate::completion_weights::{CompletionWeights, Shape, split_lists};
use crate::lanes::{Kernel, Lanes, MAX_OCTETS, Octet, WIDTH, dispatch};

/// Readings of a batch of materials, and the outputs of both nets.
///
/// Each lane of an octet belongs to one material. A list holds all entries of the first eight materials, then all of
/// the next eight, and so on. `by_x` is the gradient of the loss with respect to x.
#[derive(Clone, Debug)]
pub struct Batch {
    shape: Shape,
    /// The readings, sample by sample.
    inputs: Vec<Input<Octet>>,
    /// The coefficient net's state.
    state: Vec<Octet>,
    by_state: Vec<Octet>,
    /// The start net's hidden units, and its offset of each parameter.
    units: Vec<Octet>,
    offsets: Vec<Octet>,
    by_offsets: Vec<Octet>,
    by_inputs: Vec<[Octet; 3]>,
}

const ZERO_INPUT: Input<Octet> = Input {
    channels: [Octet([0.0; WIDTH]); 3],
    missing: Octet([0.0; WIDTH]),
};

impl Batch {
    /// Creates a batch of a given number of materials, filled with zeros.
    #[must_use]
    pub fn new(shape: Shape, materials: usize) -> Self {
        let octets = materials.div_ceil(WIDTH);
        let list = |length: usize| vec![Octet::default(); length];
        Self {
            shape,
            inputs: vec![ZERO_INPUT; shape.samples * octets],
            state: list(shape.state_len() * octets),
            by_state: list(shape.state_len() * octets),
            units: list(shape.units * octets),
            offsets: list(shape.parameters * octets),
            by_offsets: list(shape.parameters * octets),
            by_inputs: vec![[Octet::default(); 3]; shape.samples * octets],
        }
    }

    fn octets(&self) -> usize {
        self.inputs.len() / self.shape.samples.max(1)
    }

    /// Sets a material's reading of a sample: its standardized channels, or None if it is
    /// missing.
    pub fn set_reading(&mut self, material: usize, sample: usize, reading: Option<[f32; 3]>) {
        let (octet, lane) = (material / WIDTH, material % WIDTH);
        let input = &mut self.inputs[octet * self.shape.samples + sample];
        input.missing.0[lane] = if reading.is_some() { 0.0 } else { 1.0 };
        for (octet, value) in input.channels.iter_mut().zip(reading.unwrap_or_default()) {
            octet.0[lane] = value;
        }
    }

    /// Returns the gradient with respect to a material's reading of a sample.
    #[must_use]
    pub fn by_reading(&self, material: usize, sample: usize) -> [f32; 3] {
        let (octet, lane) = (material / WIDTH, material % WIDTH);
        self.by_inputs[octet * self.shape.samples + sample].map(|octet| octet.0[lane])
    }

    /// Returns the index of a coefficient in the state, and its lane.
    fn coefficient_index(
        &self,
        material: usize,
        channel: usize,
        component: usize,
    ) -> (usize, usize) {
        let rows = self.shape.rows();
        let first = material / WIDTH * self.shape.state_len();
        (first + channel * rows + component, material % WIDTH)
    }

    /// Returns the coefficients of a material: those of red, then of green, then of blue.
    #[must_use]
    pub fn coefficients(&self, material: usize) -> Vec<f32> {
        let channels = (0..3).flat_map(|channel| {
            (0..self.shape.components).map(move |component| (channel, component))
        });
        channels
            .map(|(channel, component)| {
                let (position, lane) = self.coefficient_index(material, channel, component);
                self.state[position].0[lane]
            })
            .collect()
    }

    /// Sets the gradient with respect to a material's coefficients.
    pub fn set_coefficient_gradient(&mut self, material: usize, by_coefficients: &[f32]) {
        let components = self.shape.components;
        for (index, value) in by_coefficients.iter().enumerate() {
            let (position, lane) =
                self.coefficient_index(material, index / components, index % components);
            self.by_state[position].0[lane] = *value;
        }
    }

    /// Returns the values of a material's hidden units in the coefficient net, averaged over its channels.
    #[must_use]
    pub fn hidden(&self, material: usize) -> Vec<f32> {
        let Shape {
            components, hidden, ..
        } = self.shape;
        let unit = |unit: usize| {
            let channels = (0..3).map(|channel| {
                let (position, lane) = self.coefficient_index(material, channel, components + unit);
                self.state[position].0[lane]
            });
            channels.sum::<f32>() / 3.0
        };
        (0..hidden).map(unit).collect()
    }

    /// Returns the start net's offsets of a material's initial parameters.
    #[must_use]
    pub fn offsets(&self, material: usize) -> Vec<f32> {
        let Shape { parameters, .. } = self.shape;
        let (octet, lane) = (material / WIDTH, material % WIDTH);
        let list = &self.offsets[octet * parameters..][..parameters];
        list.iter().map(|octet| octet.0[lane]).collect()
    }

    /// Sets the gradient with respect to a material's initial parameters.
    pub fn set_offset_gradient(
        &mut self,
        material: usize,
        by_offsets: impl IntoIterator<Item = f32>,
    ) {
        let Shape { parameters, .. } = self.shape;
        let (octet, lane) = (material / WIDTH, material % WIDTH);
        let list = &mut self.by_offsets[octet * parameters..][..parameters];
        for (octet, value) in list.iter_mut().zip(by_offsets) {
            octet.0[lane] = value;
        }
    }

    /// Replaces the coefficients of a material: those of red, then of green, then of blue.
    pub fn set_coefficients(&mut self, material: usize, coefficients: &[f32]) {
        let components = self.shape.components;
        for (index, value) in coefficients.iter().enumerate() {
            let (position, lane) =
                self.coefficient_index(material, index / components, index % components);
            self.state[position].0[lane] = *value;
        }
    }

    /// Returns the gradient with respect to a material's coefficients.
    #[must_use]
    pub fn coefficient_gradient(&self, material: usize) -> Vec<f32> {
        let components = self.shape.components;
        let entries = (0..3 * components).map(|index| {
            let (position, lane) =
                self.coefficient_index(material, index / components, index % components);
            self.by_state[position].0[lane]
        });
        entries.collect()
    }

    /// Computes the coefficients from the readings.
    pub fn complete(&mut self, weights: &CompletionWeights<'_>) {
        dispatch(Complete {
            batch: self,
            weights: *weights,
        });
    }

    /// Computes the offsets of the initial parameters from the coefficients.
    pub fn activate(&mut self, weights: &CompletionWeights<'_>) {
        dispatch(Activate {
            batch: self,
            weights: *weights,
        });
    }

    /// Propagates the gradients with respect to initial parameters backwards. Adds the gradient with respect to the init
    /// net's weights to the argument, and that with respect to the coefficients to the gradient of these.
    pub fn start_net_adjoint(&mut self, weights: &CompletionWeights<'_>, by_start_net: &mut [f32]) {
        dispatch(StartNetAdjoint {
            batch: self,
            weights: *weights,
            by_start_net,
        });
    }

    /// Propagates the gradients with respect to coefficients backwards. Adds the gradient with respect to the
    /// coefficient net's weights to the argument, and stores that with respect to the readings.
    pub fn adjoint(&mut self, weights: &CompletionWeights<'_>, by_coefficient_net: &mut [f32]) {
        dispatch(Adjoint {
            batch: self,
            weights: *weights,
            by_coefficient_net,
        });
    }
}

/// Loads an entry of the materials on the lanes, beginning with octet `first` of `octets`. `list` has `length` entries
/// for each octet of materials. Lanes past the end repeat the last octet.
#[inline(always)]
fn load<L: Lanes>(list: &[Octet], length: usize, first: usize, octets: usize, entry: usize) -> L {
    let mut sources = [&list[first * length + entry]; MAX_OCTETS];
    for (k, source) in sources.iter_mut().enumerate().take(L::OCTETS) {
        *source = &list[(first + k).min(octets - 1) * length + entry];
    }
    L::load(sources)
}

/// Loads all entries of a list, as [`load`] does.
#[inline(always)]
fn load_list<L: Lanes>(
    list: &[Octet],
    length: usize,
    first: usize,
    octets: usize,
    values: &mut [L],
) {
    for (entry, value) in values.iter_mut().enumerate() {
        *value = load(list, length, first, octets, entry);
    }
}

/// Stores what [`load`] loads, without the lanes past the end.
#[inline(always)]
fn store<L: Lanes>(
    value: L,
    list: &mut [Octet],
    length: usize,
    first: usize,
    octets: usize,
    entry: usize,
) {
    let mut stored = [Octet::default(); MAX_OCTETS];
    value.store(&mut stored);
    for (k, octet) in stored
        .iter()
        .enumerate()
        .take(L::OCTETS.min(octets - first))
    {
        list[(first + k) * length + entry] = *octet;
    }
}

/// Loads the inputs of all samples, as [`load`] does.
#[inline(always)]
fn load_inputs<L: Lanes>(batch: &Batch, first: usize, inputs: &mut Vec<Input<L>>) {
    let (samples, octets) = (batch.shape.samples, batch.octets());
    inputs.clear();
    for sample in 0..samples {
        let mut sources = [&batch.inputs[first * samples + sample]; MAX_OCTETS];
        for (k, source) in sources.iter_mut().enumerate().take(L::OCTETS) {
            *source = &batch.inputs[(first + k).min(octets - 1) * samples + sample];
        }
        let [a, b, c, d] = sources;
        inputs.push(Input {
            channels: [
                L::load([
                    &a.channels[0],
                    &b.channels[0],
                    &c.channels[0],
                    &d.channels[0],
                ]),
                L::load([
                    &a.channels[1],
                    &b.channels[1],
                    &c.channels[1],
                    &d.channels[1],
                ]),
                L::load([
                    &a.channels[2],
                    &b.channels[2],
                    &c.channels[2],
                    &d.channels[2],
                ]),
            ],
            missing: L::load([&a.missing, &b.missing, &c.missing, &d.missing]),
        });
    }
}

struct Complete<'b, 'w> {
    batch: &'b mut Batch,
    weights: CompletionWeights<'w>,
}

impl Kernel for Complete<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { batch, weights } = self;
        let shape = batch.shape;
        let (octets, state_len) = (batch.octets(), shape.state_len());
        let coefficient_net = weights.coefficient_net::<L>();
        let mut inputs = Vec::with_capacity(shape.samples);
        let mut state = vec![L::constant(0.0); state_len];
        for first in (0..octets).step_by(L::OCTETS) {
            load_inputs(batch, first, &mut inputs);
            coefficient_net.compute(&inputs, &mut state);
            for (entry, value) in state.iter().enumerate() {
                store(*value, &mut batch.state, state_len, first, octets, entry);
            }
        }
    }
}

struct Activate<'b, 'w> {
    batch: &'b mut Batch,
    weights: CompletionWeights<'w>,
}

impl Kernel for Activate<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { batch, weights } = self;
        let shape = batch.shape;
        let (octets, state_len) = (batch.octets(), shape.state_len());
        let coefficient_net = weights.coefficient_net::<L>();
        let start_net = weights.start_net::<L>();
        let mut state = vec![L::constant(0.0); state_len];
        let mut units = vec![L::constant(0.0); shape.units];
        for first in (0..octets).step_by(L::OCTETS) {
            load_list(&batch.state, state_len, first, octets, &mut state);
            start_net.activate(coefficient_net.coefficients(&state), &mut units);
            for (unit, value) in units.iter().enumerate() {
                store(*value, &mut batch.units, shape.units, first, octets, unit);
            }
            for parameter in 0..shape.parameters {
                let offset = start_net.offset(parameter, &units);
                store(
                    offset,
                    &mut batch.offsets,
                    shape.parameters,
                    first,
                    octets,
                    parameter,
                );
            }
        }
    }
}

/// Returns the lanes of octets from `first` on that are not past the end: 1, or 0 for lanes that repeat the last octet.
#[inline(always)]
fn valid_lanes<L: Lanes>(first: usize, octets: usize) -> L {
    let mut valid = [Octet([1.0; WIDTH]); MAX_OCTETS];
    for (k, octet) in valid.iter_mut().enumerate() {
        *octet = Octet([if first + k < octets { 1.0 } else { 0.0 }; WIDTH]);
    }
    let [a, b, c, d] = &valid;
    L::load([a, b, c, d])
}

struct StartNetAdjoint<'b, 'w, 'g> {
    batch: &'b mut Batch,
    weights: CompletionWeights<'w>,
    by_start_net: &'g mut [f32],
}

impl Kernel for StartNetAdjoint<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self {
            batch,
            weights,
            by_start_net,
        } = self;
        let shape = batch.shape;
        let (octets, rows, state_len) = (batch.octets(), shape.rows(), shape.state_len());
        let coefficient_net = weights.coefficient_net::<L>();
        let mut state = vec![L::constant(0.0); state_len];
        let mut by_state = state.clone();
        let mut units = vec![L::constant(0.0); shape.units];
        let mut by_units = units.clone();
        let mut by_offsets = vec![L::constant(0.0); shape.parameters];
        let mut sums = vec![L::zero_sum(); by_start_net.len()];
        for first in (0..octets).step_by(L::OCTETS) {
            let valid = valid_lanes::<L>(first, octets);
            load_list(&batch.state, state_len, first, octets, &mut state);
            load_list(&batch.by_state, state_len, first, octets, &mut by_state);
            load_list(&batch.units, shape.units, first, octets, &mut units);
            for (parameter, value) in by_offsets.iter_mut().enumerate() {
                let list = &batch.by_offsets;
                *value = load::<L>(list, shape.parameters, first, octets, parameter) * valid;
            }
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
            for (entry, value) in by_state.iter().enumerate() {
                store(*value, &mut batch.by_state, state_len, first, octets, entry);
            }
        }
        add_totals::<L>(&sums, by_start_net);
    }
}

struct Adjoint<'b, 'w, 'g> {
    batch: &'b mut Batch,
    weights: CompletionWeights<'w>,
    by_coefficient_net: &'g mut [f32],
}

impl Kernel for Adjoint<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self {
            batch,
            weights,
            by_coefficient_net,
        } = self;
        let shape = batch.shape;
        let (octets, state_len) = (batch.octets(), shape.state_len());
        let coefficient_net = weights.coefficient_net::<L>();
        let mut inputs = Vec::with_capacity(shape.samples);
        let mut state = vec![L::constant(0.0); state_len];
        let mut by_state = vec![L::constant(0.0); state_len];
        let mut by_inputs = vec![[L::constant(0.0); 3]; shape.samples];
        let mut sums = vec![L::zero_sum(); by_coefficient_net.len()];
        for first in (0..octets).step_by(L::OCTETS) {
            let valid = valid_lanes::<L>(first, octets);
            load_inputs(batch, first, &mut inputs);
            load_list(&batch.state, state_len, first, octets, &mut state);
            for (entry, value) in by_state.iter_mut().enumerate() {
                *value = load::<L>(&batch.by_state, state_len, first, octets, entry) * valid;
            }
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
            for (sample, by_input) in by_inputs.iter().enumerate() {
                for (channel, value) in by_input.iter().enumerate() {
                    let mut stored = [Octet::default(); MAX_OCTETS];
                    value.store(&mut stored);
                    for (k, octet) in stored
                        .iter()
                        .enumerate()
                        .take(L::OCTETS.min(octets - first))
                    {
                        batch.by_inputs[(first + k) * shape.samples + sample][channel] = *octet;
                    }
                }
            }
        }
        add_totals::<L>(&sums, by_coefficient_net);
    }
}

/// Adds the total of each sum to an entry of a gradient.
#[inline(always)]
fn add_totals<L: Lanes>(sums: &[L::Sum], gradient: &mut [f32]) {
    let mut totals = vec![0.0; gradient.len()];
    L::totals(sums, &mut totals);
    for (entry, total) in gradient.iter_mut().zip(totals) {
        *entry += total;
    }
}
