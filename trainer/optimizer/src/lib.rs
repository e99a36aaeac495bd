//! The meta-parameters, held, stepped and recorded by burn.
//!
//! A crate of its own because burn's tensors are generic over their backend: whatever is done with
//! one is compiled where it is done, for every type of number. Here that happens once, and not again
//! whenever the trainer changes.

use burn::module::{Module, Param, ParamId};
use burn::record::{BinBytesRecorder, FullPrecisionSettings, Recorder};
use burn::tensor::backend::Backend;
use burn::tensor::{Tensor, TensorData};
use burn_autodiff::Autodiff;
use burn_ndarray::{NdArray, NdArrayDevice};
use burn_optim::adaptor::OptimizerAdaptor;
use burn_optim::{Adam, AdamConfig, GradientsParams, Optimizer};
use serde::{Deserialize, Serialize};

/// The backend: meta-gradients are computed outside of it, exactly, and registered with it.
pub type B = Autodiff<NdArray>;

const DEVICE: NdArrayDevice = NdArrayDevice::Cpu;

/// What is meta-learned.
#[derive(Module, Debug)]
pub struct MetaParameters<B: Backend> {
    /// theta_0, in the model's order.
    initial: Param<Tensor<B, 1>>,
    /// alpha, a step size for each parameter, or its logarithm.
    step_sizes: Param<Tensor<B, 1>>,
    /// Logits of the pattern, three for each sample.
    pattern: Param<Tensor<B, 1>>,
}

/// One list of numbers for each group of meta-parameters: values, gradients, learning rates.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Groups<T> {
    /// theta_0.
    pub initial: T,
    /// alpha or ln alpha.
    pub step_sizes: T,
    /// Logits of the pattern.
    pub pattern: T,
}

impl<T> Groups<T> {
    /// The groups, in a fixed order.
    pub fn each(&self) -> [&T; 3] {
        [&self.initial, &self.step_sizes, &self.pattern]
    }

    /// The groups, to be changed.
    pub fn each_mut(&mut self) -> [&mut T; 3] {
        [&mut self.initial, &mut self.step_sizes, &mut self.pattern]
    }
}

/// Meta-parameters and the state of their optimizer.
pub struct Optimization {
    parameters: MetaParameters<B>,
    optimizer: OptimizerAdaptor<Adam, MetaParameters<B>, B>,
}

fn tensor<B: Backend<Device = NdArrayDevice>>(values: Vec<f32>) -> Tensor<B, 1> {
    let length = values.len();
    Tensor::from_data(TensorData::new(values, [length]), &DEVICE)
}

fn parameter(id: u64, values: Vec<f32>) -> Param<Tensor<B, 1>> {
    Param::initialized(ParamId::from(id), tensor::<B>(values).require_grad())
}

fn adam() -> OptimizerAdaptor<Adam, MetaParameters<B>, B> {
    AdamConfig::new().with_epsilon(1e-8).init()
}

impl Optimization {
    /// Begins with given values.
    #[must_use]
    pub fn new(values: Groups<Vec<f32>>) -> Self {
        Self {
            parameters: MetaParameters {
                initial: parameter(1, values.initial),
                step_sizes: parameter(2, values.step_sizes),
                pattern: parameter(3, values.pattern),
            },
            optimizer: adam(),
        }
    }

    /// The values as they are now.
    #[must_use]
    pub fn values(&self) -> Groups<Vec<f32>> {
        let list = |parameter: &Param<Tensor<B, 1>>| {
            let data = parameter.val().into_data();
            data.iter::<f32>().collect()
        };
        Groups {
            initial: list(&self.parameters.initial),
            step_sizes: list(&self.parameters.step_sizes),
            pattern: list(&self.parameters.pattern),
        }
    }

    /// One step of Adam, each group at its own rate; a rate of 0 leaves a group alone.
    pub fn step(&mut self, gradients: Groups<Vec<f32>>, rates: &Groups<f64>) {
        let ids = [1, 2, 3].map(ParamId::from);
        let Groups {
            initial,
            step_sizes,
            pattern,
        } = gradients;
        let gradients = [initial, step_sizes, pattern];
        for ((id, gradient), rate) in ids.into_iter().zip(gradients).zip(rates.each()) {
            if *rate == 0.0 {
                continue;
            }
            let mut registered = GradientsParams::new();
            registered.register::<NdArray, 1>(id, tensor(gradient));
            let parameters = self.parameters.clone();
            self.parameters = self.optimizer.step(*rate, parameters, registered);
        }
    }

    /// Parameters and optimizer as bytes.
    ///
    /// # Errors
    /// If burn cannot record them.
    pub fn record(&self) -> Result<Vec<u8>, burn::record::RecorderError> {
        let record = (
            self.parameters.clone().into_record(),
            self.optimizer.to_record(),
        );
        BinBytesRecorder::<FullPrecisionSettings>::default().record(record, ())
    }

    /// Takes up what [`Optimization::record`] wrote.
    ///
    /// # Errors
    /// If the bytes are not such a record.
    pub fn restore(mut self, bytes: Vec<u8>) -> Result<Self, burn::record::RecorderError> {
        let (parameters, optimizer) =
            BinBytesRecorder::<FullPrecisionSettings>::default().load(bytes, &DEVICE)?;
        self.parameters = self.parameters.load_record(parameters);
        self.optimizer = self.optimizer.load_record(optimizer);
        Ok(self)
    }
}
