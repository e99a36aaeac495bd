//! The input of a training run.

use glimpse_fitting::recipe::options::TrainingOptions;
use glimpse_fitting::recipe::sections::Arena;
use glimpse_materials::Material;

use crate::outer::Session;

/// A training run to do, of any schedule.
pub(crate) struct Job<'a, 'o> {
    /// The memory of the recipe's lists.
    pub(crate) arena: &'a Arena,
    /// The valid options.
    pub(crate) options: &'a TrainingOptions,
    /// The training materials.
    pub(crate) materials: Vec<Box<dyn Material>>,
    /// The session of the outer loop.
    pub(crate) session: Session<'a, 'o>,
}
