//! Least squares of errors over parameters within bounds (Levenberg-Marquardt), by difference quotients.

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn};

/// The step of a parameter in a difference quotient, as a share of its range.
const STEP: f64 = 1e-5;
/// The smallest distance of a start from the bounds of a parameter, as a share of its range. At a bound, no gradient leads
/// back.
const MARGIN: f64 = 0.02;

/// A vector of errors as a function of parameters within bounds.
pub(crate) struct Errors<'f> {
    /// The number of errors.
    pub(crate) count: usize,
    /// Writes the errors of parameters.
    pub(crate) write: &'f (dyn Fn(&[f64], &mut [f64]) + Sync),
    /// The smallest and the largest value of each parameter.
    pub(crate) bounds: &'f [[f64; 2]],
    /// The number of evaluations after which a minimization ends, divided by the number of parameters plus 1.
    pub(crate) patience: usize,
}

impl Errors<'_> {
    /// Minimizes the sum of squares from a start. Returns it, and the parameters.
    pub(crate) fn minimize(&self, start: &[f64]) -> (f64, Vec<f64>) {
        let logits = self.bounds.iter().zip(start).map(|([min, max], value)| {
            let share = ((value - min) / (max - min)).clamp(MARGIN, 1.0 - MARGIN);
            (share / (1.0 - share)).ln()
        });
        let logits = DVector::from_iterator(start.len(), logits);
        let mut problem = Problem {
            errors: self,
            residuals: DVector::zeros(self.count),
            logits: DVector::zeros(start.len()),
        };
        problem.set_params(&logits);
        let (problem, _) = LevenbergMarquardt::new()
            .with_patience(self.patience)
            .minimize(problem);
        (problem.residuals.norm_squared(), problem.values())
    }
}

/// The state of a minimization: the logits of the parameters between their bounds, and the errors.
struct Problem<'e> {
    errors: &'e Errors<'e>,
    logits: DVector<f64>,
    residuals: DVector<f64>,
}

impl Problem<'_> {
    fn values(&self) -> Vec<f64> {
        let bounds = self.errors.bounds.iter().zip(self.logits.iter());
        let values = bounds.map(|([min, max], logit)| min + (max - min) / (1.0 + (-logit).exp()));
        values.collect()
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, logits: &DVector<f64>) {
        self.logits.copy_from(logits);
        (self.errors.write)(&self.values(), self.residuals.as_mut_slice());
    }

    fn params(&self) -> DVector<f64> {
        self.logits.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        Some(self.residuals.clone())
    }

    /// Returns difference quotients.
    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let mut jacobian = DMatrix::zeros(self.errors.count, self.logits.len());
        let values = self.values();
        let mut changed = vec![0.0; self.errors.count];
        for (index, [min, max]) in self.errors.bounds.iter().enumerate() {
            let range = max - min;
            let share = (values[index] - min) / range;
            // Away from the nearer bound.
            let step = if share > 0.5 { -STEP } else { STEP };
            let mut moved = values.clone();
            moved[index] += step * range;
            (self.errors.write)(&moved, &mut changed);
            let by_logit = share * (1.0 - share) / step;
            let mut column = jacobian.column_mut(index);
            let residuals = self.residuals.iter();
            for ((entry, changed), residual) in column.iter_mut().zip(&changed).zip(residuals) {
                *entry = by_logit * (changed - residual);
            }
        }
        Some(jacobian)
    }
}
