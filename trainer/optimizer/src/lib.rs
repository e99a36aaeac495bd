//! Meta-parameters and their Adam optimizer, whose steps burn takes.
//!
//! This is a separate crate because burn's tensors are generic over their backend: each crate that uses them compiles
//! them again. Changes to the trainer do not recompile this crate.

use burn::optim::{AdamConfig, AdamState, AdaptiveMomentumState, SimpleOptimizer};
use burn::tensor::{DType, Tensor, TensorData};
use burn_ndarray::{NdArray, NdArrayDevice};
use serde::{Deserialize, Serialize};

/// The backend, without automatic differentiation: meta-gradients are computed exactly outside of burn.
type Backend = NdArray;

const DEVICE: NdArrayDevice = NdArrayDevice::Cpu;

/// One entry for each group of meta-parameters, for example its values, gradients or learning rate.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Groups<T> {
    /// theta_0, the initial parameters.
    pub initial: T,
    /// The other parameters of the fit. With schedule paper the step sizes alpha, empty for Linear; with schedule prior
    /// the logarithms of its hyperparameters.
    pub hyperparameters: T,
    /// The logits of the pattern.
    pub pattern: T,
    /// The weights of the coefficient net.
    pub coefficient_net: T,
    /// The weights of the start net.
    pub start_net: T,
}

/// Meta-parameters, or their gradient.
pub type MetaValues = Groups<Vec<f32>>;

impl<T> Groups<T> {
    /// Returns the groups in a fixed order.
    pub fn each(&self) -> [&T; 5] {
        [
            &self.initial,
            &self.hyperparameters,
            &self.pattern,
            &self.coefficient_net,
            &self.start_net,
        ]
    }

    /// Returns mutable references to the groups, in the order of [`Groups::each`].
    pub fn each_mut(&mut self) -> [&mut T; 5] {
        [
            &mut self.initial,
            &mut self.hyperparameters,
            &mut self.pattern,
            &mut self.coefficient_net,
            &mut self.start_net,
        ]
    }

    /// Applies a function to each group.
    pub fn map<U>(&self, mut function: impl FnMut(&T) -> U) -> Groups<U> {
        Groups {
            initial: function(&self.initial),
            hyperparameters: function(&self.hyperparameters),
            pattern: function(&self.pattern),
            coefficient_net: function(&self.coefficient_net),
            start_net: function(&self.start_net),
        }
    }
}

/// Meta-parameters with their Adam optimizer, as plain numbers. Only a step converts them to tensors: reading a stored
/// tensor would share it, and burn copies a shared tensor one number at a time, which takes longer than the step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Optimizer {
    /// The current values.
    pub values: MetaValues,
    /// The running means of gradients.
    first_moments: MetaValues,
    /// The running means of squared gradients.
    second_moments: MetaValues,
    /// The number of steps of each group.
    steps: Groups<u64>,
}

fn tensor(values: Vec<f32>) -> Tensor<Backend, 1> {
    let length = values.len();
    // The type is explicit because the default depends on the first use of burn in this process.
    Tensor::from_data(TensorData::new(values, [length]), (&DEVICE, DType::F32))
}

fn to_vec(tensor: Tensor<Backend, 1>) -> Vec<f32> {
    let numbers = tensor.into_data().into_vec();
    numbers.expect("the tensor has the type f32")
}

impl Optimizer {
    /// Creates an optimizer with the given values.
    #[must_use]
    pub fn new(values: MetaValues) -> Self {
        let zeros = values.map(|list| vec![0.0; list.len()]);
        Self {
            values,
            first_moments: zeros.clone(),
            second_moments: zeros,
            steps: Groups::default(),
        }
    }

    /// Takes one step of Adam with a learning rate for each group. A rate of 0 leaves a group unchanged.
    pub fn step(&mut self, gradients: MetaValues, rates: &Groups<f64>) {
        let adam = AdamConfig::new().with_epsilon(1e-8).build();
        let lists = self.values.each_mut().into_iter();
        let moments = self.first_moments.each_mut().into_iter();
        let moments = moments.zip(self.second_moments.each_mut());
        let groups = lists.zip(moments).zip(self.steps.each_mut());
        let inputs = gradients.each().into_iter().zip(rates.each());
        for (((values, (first, second)), steps), (gradient, rate)) in groups.zip(inputs) {
            if *rate == 0.0 || gradient.is_empty() {
                continue;
            }
            let [before, first_before, second_before] =
                [&mut *values, &mut *first, &mut *second].map(|list| tensor(std::mem::take(list)));
            let momentum = AdaptiveMomentumState::new(*steps as usize, first_before, second_before);
            let state = Some(AdamState::new(momentum));
            let (after, state) = adam.step(*rate, before, tensor(gradient.clone()), state);
            *values = to_vec(after);
            if let Some(AdamState { momentum }) = state {
                *steps = momentum.time as u64;
                *first = to_vec(momentum.moment_1);
                *second = to_vec(momentum.moment_2);
            }
        }
    }

    /// Applies a rearrangement of numbers to the values, and to the moments. It must keep all lengths.
    pub fn rearrange(&mut self, rearrange: impl Fn(MetaValues) -> MetaValues) {
        for lists in [
            &mut self.values,
            &mut self.first_moments,
            &mut self.second_moments,
        ] {
            *lists = rearrange(std::mem::take(lists));
        }
    }

    /// Returns true if each group has as many moments as values. Bytes of a file may differ.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let lengths = |lists: &MetaValues| lists.each().map(Vec::len);
        [&self.first_moments, &self.second_moments]
            .iter()
            .all(|moments| lengths(moments) == lengths(&self.values))
    }
}
