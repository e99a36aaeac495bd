//! The objective of schedule paper for the model Linear: a ridge stage without a net, whose pattern is trained.
//!
//! A material has too small a loss if its basis contains it. Materials are therefore split into folds, and each material
//! is trained with the basis of all other folds. The final basis contains all materials.

use glimpse_fitting::linear::ComponentsAt;
use glimpse_fitting::recipe::expected_loss::LossEstimate;
use glimpse_kernels::components::{ComponentTable, component_loss};
use glimpse_materials::Material;
use glimpse_materials::basis::BasisTable;
use glimpse_materials::sampling::uniform_valid;
use glimpse_optimizer::Groups;
use rayon::prelude::*;

use super::objective::{LossSamples, PaperObjective};
use crate::correction::Correction;
use crate::linear::{Columns, principal_components};
use crate::outer::{MetaValues, OuterStep, scaled_sum};
use crate::pattern::{Reach, SamplePattern};
use crate::streams::RandomStreams;
use crate::tasks::pool::WarpedPool;
use crate::tasks::reading::TaskReading;
use crate::tasks::samples::uniform_weight;
use crate::tasks::task::TrainingTask;

/// The number of folds.
const FOLDS: usize = 5;
/// The number of pool directions. The loss of a task uses a random selection of them.
const POOL: usize = 8_192;

/// The objective of the model Linear.
pub struct RidgeObjective {
    streams: RandomStreams,
    eta: f32,
    pool: WarpedPool,
    folds: Vec<Fold>,
}

/// The basis of all materials outside a fold.
struct Fold {
    basis: BasisTable,
    /// The components at the pool.
    table: ComponentTable,
}

impl RidgeObjective {
    /// Computes the basis of each fold, with at most `components` components. `eta` is the precision of coefficients.
    #[must_use]
    pub fn new(
        materials: Vec<Box<dyn Material>>,
        columns: &Columns,
        components: usize,
        eta: f32,
        seed: u64,
    ) -> Self {
        let count = FOLDS.min(materials.len());
        // A single material is trained with its own basis.
        let columns_outside =
            |fold: usize| columns.columns_of(|index| count == 1 || index % count != fold);
        let min_columns = (0..count).map(|fold| columns_outside(fold).len()).min();
        let components = components.min(min_columns.unwrap_or(0).max(2) - 1);
        let pool = WarpedPool::new(materials.into(), 0, uniform_valid(POOL, seed));
        let folds = (0..count).map(|fold| {
            let basis = principal_components(columns, &columns_outside(fold), components);
            Fold {
                table: pool.components(&basis),
                basis,
            }
        });
        Self {
            streams: RandomStreams { seed },
            eta,
            folds: folds.collect(),
            pool,
        }
    }

    /// Returns the number of components, m.
    #[must_use]
    pub fn components(&self) -> usize {
        self.folds.first().map_or(0, |fold| fold.basis.components())
    }

    /// Fits a task, and returns its loss and the gradient with respect to the angles of each sample.
    fn task_gradient(&self, pattern: &SamplePattern, task: &TrainingTask) -> (f32, Vec<[f32; 3]>) {
        let Fold { basis, table } = &self.folds[task.material % self.folds.len()];
        let components = basis.components();
        let at = ComponentsAt::new(basis, pattern.angles.clone());
        let correction = Correction::new(at, components, &vec![self.eta; components]);
        let readings = TaskReading::read_task(task, &self.pool.materials, 0, &correction.at);
        // Without a net, all coefficients are 0 before the correction.
        let corrected = correction.correct(&readings, &task.present, &vec![0.0; 3 * components]);
        let mut by_coefficients = vec![0.0; 3 * components];
        let values = task.values(&self.pool);
        let [loss, _] = component_loss(
            table,
            &corrected.coefficients,
            &task.octets,
            &values,
            uniform_weight(values.len()),
            Some(&mut by_coefficients),
        );
        let gradient = correction.adjoint(&corrected, &readings, &by_coefficients);
        (loss, gradient.angles)
    }
}

impl PaperObjective for RidgeObjective {
    fn initial_values(&self) -> MetaValues {
        MetaValues::default()
    }

    fn gradient(
        &self,
        values: &MetaValues,
        outer_step: OuterStep,
        samples: LossSamples,
    ) -> (f32, MetaValues) {
        let pattern = Reach::ANY.pattern(&values.pattern);
        let batch = self.streams.batch(outer_step, self.pool.materials.len());
        let gradients = batch.par_iter().enumerate().map(|(slot, material)| {
            let mut random = self.streams.slot(outer_step, slot + 1);
            let task = TrainingTask {
                octets: self.pool.draw(samples.outer, &mut random),
                present: pattern.valid.clone(),
                ..TrainingTask::plain(*material, 0, 0)
            };
            let (loss, by_angles) = self.task_gradient(&pattern, &task);
            let gradient = Groups {
                pattern: pattern.gradient_by_logits(|index| by_angles[index]),
                ..Groups::default()
            };
            (loss, gradient)
        });
        scaled_sum(1.0 / batch.len() as f32, &gradients.collect::<Vec<_>>())
    }

    /// No materials are held out: each is fitted with the basis of other folds.
    fn expected_loss(&self, values: &MetaValues) -> LossEstimate {
        let pattern = Reach::ANY.reachable_pattern(&values.pattern);
        let count = self.pool.materials.len();
        let losses = (0..count).into_par_iter().map(|material| {
            let (samples, octets) = (pattern.angles.len(), self.pool.octet_count());
            let task = TrainingTask::plain(material, samples, octets);
            self.task_gradient(&pattern, &task).0
        });
        LossEstimate::of(&losses.collect::<Vec<_>>())
    }
}
