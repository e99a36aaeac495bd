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
    pub fn map<U>(self, mut function: impl FnMut(T) -> U) -> Groups<U> {
        Groups {
            initial: function(self.initial),
            hyperparameters: function(self.hyperparameters),
            pattern: function(self.pattern),
            coefficient_net: function(self.coefficient_net),
            start_net: function(self.start_net),
        }
    }

    /// Returns references to the groups.
    pub fn as_ref(&self) -> Groups<&T> {
        Groups {
            initial: &self.initial,
            hyperparameters: &self.hyperparameters,
            pattern: &self.pattern,
            coefficient_net: &self.coefficient_net,
            start_net: &self.start_net,
        }
    }
}

/// Meta-parameters with their Adam optimizer, as plain numbers. Only a step converts them to tensors: reading a stored
/// tensor would share it, and burn copies a shared tensor one number at a time, which takes longer than the step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Optimizer(Groups<Group>);

/// The parameters of a group, and Adam's state: None before the first step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Group {
    values: Vec<f32>,
    moments: Option<Moments>,
}

/// Adam's state: the number of steps, and the running means of gradients and of squared gradients.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Moments {
    steps: u64,
    first: Vec<f32>,
    second: Vec<f32>,
}

fn tensor(values: Vec<f32>) -> Tensor<Backend, 1> {
    let length = values.len();
    // The type is explicit because the default depends on the first use of burn in this process.
    Tensor::from_data(TensorData::new(values, [length]), (&DEVICE, DType::F32))
}

fn to_vec(tensor: Tensor<Backend, 1>) -> Vec<f32> {
    let data = tensor.into_data();
    match data.as_slice() {
        Ok(numbers) => numbers.to_vec(),
        Err(_) => data.iter::<f32>().collect(),
    }
}

impl Group {
    /// Takes one step of Adam.
    fn step(&mut self, gradient: Vec<f32>, rate: f64) {
        let state = self.moments.take().map(|moments| {
            AdamState::new(AdaptiveMomentumState::new(
                moments.steps as usize,
                tensor(moments.first),
                tensor(moments.second),
            ))
        });
        let adam = AdamConfig::new().with_epsilon(1e-8).build();
        let values = tensor(std::mem::take(&mut self.values));
        let (values, state) = adam.step(rate, values, tensor(gradient), state);
        self.values = to_vec(values);
        self.moments = state.map(|AdamState { momentum }| Moments {
            steps: momentum.time as u64,
            first: to_vec(momentum.moment_1),
            second: to_vec(momentum.moment_2),
        });
    }

    fn lists_mut(&mut self) -> [Option<&mut Vec<f32>>; 3] {
        let (first, second) = match &mut self.moments {
            Some(moments) => (Some(&mut moments.first), Some(&mut moments.second)),
            None => (None, None),
        };
        [Some(&mut self.values), first, second]
    }
}

impl Optimizer {
    /// Creates an optimizer with the given values.
    #[must_use]
    pub fn new(values: Groups<Vec<f32>>) -> Self {
        Self(values.map(|values| Group {
            values,
            moments: None,
        }))
    }

    /// Returns the current values.
    #[must_use]
    pub fn values(&self) -> Groups<Vec<f32>> {
        self.0.as_ref().map(|group| group.values.clone())
    }

    /// Returns the pattern, for a projection onto its constraints after a step.
    pub fn pattern_mut(&mut self) -> &mut [f32] {
        &mut self.0.pattern.values
    }

    /// Takes one step of Adam with a learning rate for each group. A rate of 0 leaves a group unchanged.
    pub fn step(&mut self, gradients: Groups<Vec<f32>>, rates: &Groups<f64>) {
        let groups = self.0.each_mut().into_iter();
        for ((group, gradient), rate) in groups.zip(gradients.each()).zip(rates.each()) {
            if *rate != 0.0 && !gradient.is_empty() {
                group.step(gradient.clone(), *rate);
            }
        }
    }

    /// Applies a rearrangement of numbers to the values, and to the moments. It must keep all lengths, and is also called
    /// with empty lists.
    pub fn rearrange(&mut self, rearrange: impl Fn(Groups<Vec<f32>>) -> Groups<Vec<f32>>) {
        for index in 0..3 {
            let take = |group: &mut Group| group.lists_mut()[index].take().map(std::mem::take);
            let mut before = Groups::default();
            for (list, group) in before.each_mut().into_iter().zip(self.0.each_mut()) {
                *list = take(group).unwrap_or_default();
            }
            let mut after = rearrange(before);
            for (list, group) in after.each_mut().into_iter().zip(self.0.each_mut()) {
                if let Some(target) = group.lists_mut()[index].take() {
                    *target = std::mem::take(list);
                }
            }
        }
    }

    /// Returns true if each group has as many moments as values. Bytes of a file may differ.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.0.each().into_iter().all(|Group { values, moments }| {
            let lengths = |moments: &Moments| [moments.first.len(), moments.second.len()];
            let moments = moments.as_ref().map(lengths);
            moments.is_none_or(|lengths| lengths == [values.len(); 2])
        })
    }
}
