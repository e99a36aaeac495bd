//! The meta-parameters, held, stepped and recorded by burn.
//!
//! A crate of its own because burn's tensors are generic over their backend: whatever is done with
//! one is compiled where it is done, for every type of number. Here that happens once, and not again
//! whenever the trainer changes.

use burn::record::{BinBytesRecorder, FullPrecisionSettings, Recorder, RecorderError};
use burn::tensor::{Tensor, TensorData};
use burn_ndarray::{NdArray, NdArrayDevice};
use burn_optim::{Adam, AdamConfig, AdamState, SimpleOptimizer};
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
}

impl<T> Groups<T> {
    /// The groups, in a fixed order.
    pub fn each(&self) -> [&T; 3] {
        [&self.initial, &self.hyperparameters, &self.pattern]
    }

    /// The groups, to be changed.
    pub fn each_mut(&mut self) -> [&mut T; 3] {
        [
            &mut self.initial,
            &mut self.hyperparameters,
            &mut self.pattern,
        ]
    }
}

/// Meta-parameters and the state of their optimizer.
pub struct Optimization {
    adam: Adam,
    groups: Groups<Group>,
}

/// Some parameters, and what Adam remembers of their gradients: nothing before the first step.
type Group = (Tensor<B, 1>, Option<AdamState<B, 1>>);

fn tensor(values: Vec<f32>) -> Tensor<B, 1> {
    let length = values.len();
    Tensor::from_data(TensorData::new(values, [length]), &DEVICE)
}

fn recorder() -> BinBytesRecorder<FullPrecisionSettings> {
    BinBytesRecorder::default()
}

impl Optimization {
    /// Begins with given values.
    #[must_use]
    pub fn new(values: Groups<Vec<f32>>) -> Self {
        let group = |values| (tensor(values), None);
        Self {
            adam: AdamConfig::new().with_epsilon(1e-8).build(),
            groups: Groups {
                initial: group(values.initial),
                hyperparameters: group(values.hyperparameters),
                pattern: group(values.pattern),
            },
        }
    }

    /// The values as they are now.
    #[must_use]
    pub fn values(&self) -> Groups<Vec<f32>> {
        let [initial, hyperparameters, pattern] = self.groups.each().map(|(values, _)| {
            let data = values.to_data();
            data.iter::<f32>().collect()
        });
        Groups {
            initial,
            hyperparameters,
            pattern,
        }
    }

    /// One step of Adam, each group at its own rate; a rate of 0 leaves a group alone.
    pub fn step(&mut self, gradients: Groups<Vec<f32>>, rates: &Groups<f64>) {
        let Groups {
            initial,
            hyperparameters,
            pattern,
        } = gradients;
        let gradients = [initial, hyperparameters, pattern];
        let groups = self.groups.each_mut().into_iter();
        for ((group, gradient), rate) in groups.zip(gradients).zip(rates.each()) {
            if *rate == 0.0 {
                continue;
            }
            let (values, state) = group.clone();
            *group = self.adam.step(*rate, values, tensor(gradient), state);
        }
    }

    /// Parameters and optimizer as bytes.
    ///
    /// # Errors
    /// If burn cannot record them.
    pub fn record(&self) -> Result<Vec<u8>, RecorderError> {
        let [initial, hyperparameters, pattern] = self.groups.each().map(Clone::clone);
        let record = (initial, hyperparameters, pattern);
        Recorder::<B>::record(&recorder(), record, ())
    }

    /// Takes up what [`Optimization::record`] wrote.
    ///
    /// # Errors
    /// If the bytes are not such a record.
    pub fn restore(mut self, bytes: Vec<u8>) -> Result<Self, RecorderError> {
        let (initial, hyperparameters, pattern) = Recorder::<B>::load(&recorder(), bytes, &DEVICE)?;
        self.groups = Groups {
            initial,
            hyperparameters,
            pattern,
        };
        Ok(self)
    }
}
