//! The hyperparameters of schedule prior: positive numbers, whose logarithms are trained.

use glimpse_core::section::MIN_PRECISION;
use glimpse_materials::lists::add_scaled;

/// The largest hyperparameter in a recipe.
const MAX_HYPERPARAMETER: f32 = 1e4;

/// The hyperparameters of Gauss-Newton steps, or their gradient.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct StepParameters {
    /// The precision of each active parameter of a system.
    pub precision: Vec<f32>,
    /// The sum of the weights of the pattern's readings.
    pub reading_weight: f32,
    /// The error at which the weight of a reading is halved.
    pub error_scale: f32,
}

/// The hyperparameters of all stages, or their gradient.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Hyperparameters {
    /// Those of the steps; None for Linear.
    pub steps: Option<StepParameters>,
    /// The precision of each component in the ridge stage.
    pub precision: Vec<f32>,
}

impl StepParameters {
    /// sum += factor * other
    pub(super) fn add_scaled(&mut self, factor: f32, other: &Self) {
        add_scaled(&mut self.precision, factor, &other.precision);
        self.reading_weight += factor * other.reading_weight;
        self.error_scale += factor * other.error_scale;
    }
}

impl Hyperparameters {
    /// Splits a list that [`Hyperparameters::to_list`] made, given the number of components in the ridge stage.
    fn from_list(list: &[f32], components: usize) -> Self {
        let (steps, precision) = list.split_at(list.len() - components);
        let steps = match steps {
            [precision @ .., reading_weight, error_scale] => Some(StepParameters {
                precision: precision.to_vec(),
                reading_weight: *reading_weight,
                error_scale: *error_scale,
            }),
            _ => None,
        };
        Self {
            steps,
            precision: precision.to_vec(),
        }
    }

    /// Returns all numbers in one list.
    fn to_list(&self) -> Vec<f32> {
        let mut list = Vec::new();
        if let Some(steps) = &self.steps {
            list.extend(&steps.precision);
            list.extend([steps.reading_weight, steps.error_scale]);
        }
        list.extend(&self.precision);
        list
    }

    /// Returns the trained logarithms.
    pub(super) fn encode(&self) -> Vec<f32> {
        self.to_list().into_iter().map(f32::ln).collect()
    }

    /// Returns the hyperparameters of trained logarithms, within the range of recipes.
    pub(super) fn decode(logarithms: &[f32], components: usize) -> Self {
        let values = logarithms
            .iter()
            .map(|log| log.exp().clamp(MIN_PRECISION, MAX_HYPERPARAMETER));
        Self::from_list(&values.collect::<Vec<_>>(), components)
    }

    /// Returns a gradient of zeros.
    pub(super) fn zeros(&self) -> Self {
        let list = vec![0.0; self.to_list().len()];
        Self::from_list(&list, self.precision.len())
    }

    /// Returns the gradient with respect to the logarithms, given that with respect to the numbers.
    pub(super) fn by_logarithms(&self, gradient: &Self) -> Vec<f32> {
        let values = self.to_list();
        let products = gradient.to_list().into_iter().zip(values);
        products
            .map(|(derivative, value)| derivative * value)
            .collect()
    }
}
