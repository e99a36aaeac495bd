//! The meta-parameters, held and stepped by burn, and as plain numbers for files.
//!
//! A crate of its own because burn's tensors are generic over their backend: whatever is done with
//! one is compiled where it is done, for every type of number. Here that happens once, and not again
//! whenever the trainer changes.

use burn::tensor::{DType, Tensor, TensorData};
use burn_ndarray::{NdArray, NdArrayDevice};
use burn_optim::{Adam, AdamConfig, AdamState, AdaptiveMomentumState, SimpleOptimizer};
use serde::{Deserialize, Serialize};

/// The backend. It has no derivatives: meta-gradients are computed outside of it, exactly.
type B = NdArray;

const DEVICE: NdArrayDevice = NdArrayDevice::Cpu;

/// One list of numbers for each group of meta-parameters: values, gradients, learning rates.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Groups<T> {
    /// theta_0.
    pub initial: T,
    /// What the fit goes by, besides where it starts: the step sizes alpha, or ln alpha; of Linear,
    /// ln of the prior's precisions.
    pub hyperparameters: T,
    /// Logits of the pattern.
    pub pattern: T,
    /// Weights that readings are completed by.
    pub completion: T,
    /// Weights from completed coefficients to where a descent starts.
    pub start: T,
}

impl<T> Groups<T> {
    /// The groups, in a fixed order.
    pub fn each(&self) -> [&T; 5] {
        [
            &self.initial,
            &self.hyperparameters,
            &self.pattern,
            &self.completion,
            &self.start,
        ]
    }

    /// The groups, to be changed.
    pub fn each_mut(&mut self) -> [&mut T; 5] {
        [
            &mut self.initial,
            &mut self.hyperparameters,
            &mut self.pattern,
            &mut self.completion,
            &mut self.start,
        ]
    }

    /// What a function makes of each group.
    pub fn map<U>(self, mut of: impl FnMut(T) -> U) -> Groups<U> {
        Groups {
            initial: of(self.initial),
            hyperparameters: of(self.hyperparameters),
            pattern: of(self.pattern),
            completion: of(self.completion),
            start: of(self.start),
        }
    }

    /// The groups, to be read.
    pub fn as_ref(&self) -> Groups<&T> {
        let [initial, hyperparameters, pattern, completion, start] = self.each();
        Groups {
            initial,
            hyperparameters,
            pattern,
            completion,
            start,
        }
    }
}

/// Meta-parameters and the state of their optimizer.
pub struct Optimization {
    adam: Adam,
    groups: Groups<Group>,
}

/// Some parameters, and what Adam remembers of their gradients: nothing before the first step.
///
/// They are a tensor only while they are stepped: reading a tensor that somebody else holds as well goes
/// number by number, and takes longer than the step.
type Group = (Vec<f32>, Option<AdamState<B, 1>>);

fn tensor(values: Vec<f32>) -> Tensor<B, 1> {
    let length = values.len();
    // Explicitly: otherwise it depends on the first use of burn in this process.
    Tensor::from_data(TensorData::new(values, [length]), (&DEVICE, DType::F32))
}

fn list(tensor: Tensor<B, 1>) -> Vec<f32> {
    let data = tensor.into_data();
    match data.as_slice() {
        Ok(numbers) => numbers.to_vec(),
        Err(_) => data.iter::<f32>().collect(),
    }
}

/// An [`Optimization`] as plain numbers, for files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record(Groups<GroupRecord>);

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct GroupRecord {
    values: Vec<f32>,
    moments: Option<Moments>,
}

/// What Adam remembers: steps so far, means of gradients, and of their squares.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Moments {
    steps: u64,
    first: Vec<f32>,
    second: Vec<f32>,
}

impl GroupRecord {
    fn of((values, state): &Group) -> Self {
        let moments = state.as_ref().map(|AdamState { momentum }| Moments {
            steps: momentum.time as u64,
            first: list(momentum.moment_1.clone()),
            second: list(momentum.moment_2.clone()),
        });
        Self {
            values: values.clone(),
            moments,
        }
    }

    fn into_group(self) -> Option<Group> {
        let length = self.values.len();
        let state = match self.moments {
            None => None,
            Some(Moments { first, second, .. }) if [first.len(), second.len()] != [length; 2] => {
                return None;
            }
            Some(moments) => Some(AdamState::new(AdaptiveMomentumState::new(
                moments.steps as usize,
                tensor(moments.first),
                tensor(moments.second),
            ))),
        };
        Some((self.values, state))
    }
}

impl Optimization {
    /// Begins with given values.
    #[must_use]
    pub fn new(values: Groups<Vec<f32>>) -> Self {
        Self {
            adam: AdamConfig::new().with_epsilon(1e-8).build(),
            groups: values.map(|values| (values, None)),
        }
    }

    /// The values as they are now.
    #[must_use]
    pub fn values(&self) -> Groups<Vec<f32>> {
        self.groups.as_ref().map(|(values, _)| values.clone())
    }

    /// One step of Adam, each group at its own rate; a rate of 0 leaves a group alone.
    pub fn step(&mut self, gradients: Groups<Vec<f32>>, rates: &Groups<f64>) {
        let groups = self.groups.each_mut().into_iter();
        for ((group, gradient), rate) in groups.zip(gradients.each()).zip(rates.each()) {
            if *rate == 0.0 || gradient.is_empty() {
                continue;
            }
            // Taken out, and not cloned: what nobody else holds is changed in place.
            let (values, state) = std::mem::take(group);
            let gradient = tensor(gradient.clone());
            let (values, state) = self.adam.step(*rate, tensor(values), gradient, state);
            *group = (list(values), state);
        }
    }

    /// All of it as plain numbers.
    #[must_use]
    pub fn record(&self) -> Record {
        Record(self.groups.as_ref().map(GroupRecord::of))
    }

    /// Takes up what [`Optimization::record`] gave; None if moments are not as many as values.
    #[must_use]
    pub fn restore(self, Record(record): Record) -> Option<Self> {
        Some(Self {
            groups: Groups {
                initial: record.initial.into_group()?,
                hyperparameters: record.hyperparameters.into_group()?,
                pattern: record.pattern.into_group()?,
                completion: record.completion.into_group()?,
                start: record.start.into_group()?,
            },
            ..self
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn groups(value: f32) -> Groups<Vec<f32>> {
        Groups {
            initial: vec![value; 5],
            hyperparameters: vec![2.0 * value; 5],
            pattern: vec![-value; 3],
            completion: vec![0.5 * value; 4],
            start: Vec::new(),
        }
    }

    const RATES: Groups<f64> = Groups {
        initial: 1e-2,
        hyperparameters: 1e-3,
        pattern: 0.0,
        completion: 2e-3,
        start: 1e-3,
    };

    #[test]
    fn what_is_restored_goes_on_in_the_same_bits() {
        let mut whole = Optimization::new(groups(0.3));
        whole.step(groups(0.7), &RATES);
        let begun = Optimization::new(groups(0.0)).restore(whole.record());
        let mut resumed = begun.expect("a record of its own");
        assert_eq!(resumed.values(), whole.values());
        for optimization in [&mut whole, &mut resumed] {
            optimization.step(groups(-0.2), &RATES);
        }
        assert_eq!(resumed.record(), whole.record());
        assert_eq!(whole.values().pattern, groups(0.3).pattern);
        assert_ne!(whole.values().initial, groups(0.3).initial);
    }

    #[test]
    fn moments_of_other_numbers_are_refused() {
        let mut optimization = Optimization::new(groups(0.3));
        optimization.step(groups(0.7), &RATES);
        let mut record = optimization.record();
        record.0.initial.values.pop();
        assert!(optimization.restore(record).is_none());
    }
}
