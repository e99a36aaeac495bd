//! Meta-parameters and their Adam optimizer, implemented with burn, and conversion of its state to plain numbers.
//!
//! This is a separate crate because burn's tensors are generic over their backend: each crate that uses them compiles
//! them again. Changes to the trainer do not recompile this crate.

use burn::optim::{Adam, AdamConfig, AdamState, AdaptiveMomentumState, SimpleOptimizer};
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

/// Meta-parameters with their Adam optimizer.
pub struct Optimizer {
    adam: Adam,
    groups: Groups<Group>,
}

/// The parameters of a group, and Adam's state: None before the first step.
///
/// The parameters are stored as a list and converted to a tensor in each step. Reading a stored tensor would
/// share it, and burn copies a shared tensor one number at a time, which takes longer than the step.
type Group = (Vec<f32>, Option<AdamState<Backend, 1>>);

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

/// The state of an [`Optimizer`] as plain numbers, for files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record(Groups<GroupRecord>);

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct GroupRecord {
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

impl GroupRecord {
    fn new((values, state): &Group) -> Self {
        let moments = state.as_ref().map(|AdamState { momentum }| Moments {
            steps: momentum.time as u64,
            first: to_vec(momentum.moment_1.clone()),
            second: to_vec(momentum.moment_2.clone()),
        });
        Self {
            values: values.clone(),
            moments,
        }
    }

    /// Returns true if there are as many moments as values.
    fn is_valid(&self) -> bool {
        let length = self.values.len();
        self.moments
            .as_ref()
            .is_none_or(|moments| moments.first.len() == length && moments.second.len() == length)
    }

    fn into_group(self) -> Group {
        let state = self.moments.map(|moments| {
            AdamState::new(AdaptiveMomentumState::new(
                moments.steps as usize,
                tensor(moments.first),
                tensor(moments.second),
            ))
        });
        (self.values, state)
    }
}

impl Optimizer {
    /// Creates an optimizer with the given values.
    #[must_use]
    pub fn new(values: Groups<Vec<f32>>) -> Self {
        Self {
            adam: AdamConfig::new().with_epsilon(1e-8).build(),
            groups: values.map(|values| (values, None)),
        }
    }

    /// Returns the current values.
    #[must_use]
    pub fn values(&self) -> Groups<Vec<f32>> {
        self.groups.as_ref().map(|(values, _)| values.clone())
    }

    /// Returns the pattern, for a projection onto its constraints after a step.
    pub fn pattern_mut(&mut self) -> &mut [f32] {
        &mut self.groups.pattern.0
    }

    /// Takes one step of Adam with a learning rate for each group. A rate of 0 leaves a group unchanged.
    pub fn step(&mut self, gradients: Groups<Vec<f32>>, rates: &Groups<f64>) {
        let groups = self.groups.each_mut().into_iter();
        for ((group, gradient), rate) in groups.zip(gradients.each()).zip(rates.each()) {
            if *rate == 0.0 || gradient.is_empty() {
                continue;
            }
            // Moved out instead of cloned, so that burn changes the unshared tensors in place.
            let (values, state) = std::mem::take(group);
            let gradient = tensor(gradient.clone());
            let (values, state) = self.adam.step(*rate, tensor(values), gradient, state);
            *group = (to_vec(values), state);
        }
    }

    /// Applies a rearrangement of numbers to the values, and to the moments. It must keep all lengths, and is also called
    /// with empty lists.
    pub fn rearrange(&mut self, rearrange: impl Fn(Groups<Vec<f32>>) -> Groups<Vec<f32>>) {
        let Record(mut record) = self.record();
        type List = fn(&mut GroupRecord) -> Option<&mut Vec<f32>>;
        let lists: [List; 3] = [
            |group| Some(&mut group.values),
            |group| Some(&mut group.moments.as_mut()?.first),
            |group| Some(&mut group.moments.as_mut()?.second),
        ];
        for list in lists {
            let before = record.clone();
            let before = before.map(|mut group| list(&mut group).map(std::mem::take));
            let after = rearrange(before.map(Option::unwrap_or_default));
            for (group, after) in record.each_mut().into_iter().zip(after.each()) {
                if let Some(list) = list(group) {
                    list.clone_from(after);
                }
            }
        }
        self.groups = record.map(GroupRecord::into_group);
    }

    /// Returns the state as plain numbers.
    #[must_use]
    pub fn record(&self) -> Record {
        Record(self.groups.as_ref().map(GroupRecord::new))
    }

    /// Restores the state from [`Optimizer::record`]. Returns None if a group has different numbers of moments and
    /// values.
    #[must_use]
    pub fn restore(self, Record(record): Record) -> Option<Self> {
        let is_valid = record.each().into_iter().all(GroupRecord::is_valid);
        is_valid.then(|| Self {
            groups: record.map(GroupRecord::into_group),
            ..self
        })
    }
}
