//! The augmented material of a task, at all directions.

use glimpse_materials::half_differences;
use std::sync::Arc;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_kernels::AngleDual;
use glimpse_materials::{Brdf, BrdfWithDerivative, Material, angles_of};

use super::highlight_warp::HighlightWarp;
use super::reading::{evaluate_warped, field_factor, mix_channel};
use super::task::TrainingTask;

/// The augmented material of a task, without noise.
pub(crate) struct TaskMaterial {
    /// The task.
    pub task: TrainingTask,
    /// The materials.
    pub materials: Arc<[Box<dyn Material>]>,
}

impl TaskMaterial {
    /// Returns the material and its partner, with their highlight warps.
    fn parts(&self) -> [(&dyn Material, HighlightWarp); 2] {
        let [own, partner] = self.task.warps.map(|index| HighlightWarp::all()[index]);
        [(self.task.material, own), (self.task.partner, partner)]
            .map(|(index, warp)| (&*self.materials[index], warp))
    }

    fn mix(
        &self,
        angles: Angles<f32>,
        own: &BrdfWithDerivative,
        partner: &BrdfWithDerivative,
    ) -> [AngleDual<f32>; 3] {
        let field = field_factor(&self.task, angles);
        std::array::from_fn(|channel| mix_channel(&self.task, channel, own, Some(partner)) * field)
    }
}

impl Brdf for TaskMaterial {
    fn values_at(&self, at: &[HalfDifference<f32>]) -> Vec<[f32; 3]> {
        let angles: Vec<Angles<f32>> = at.iter().map(angles_of).collect();
        let [own, partner] = self.parts().map(|(material, warp)| {
            let warped = angles.iter().map(|angles| warp.angles(*angles).0);
            material.values_at(&half_differences(warped))
        });
        let constant = |brdf| (brdf, [[0.0; 3]; 3]);
        let pairs = angles.into_iter().zip(own.into_iter().zip(partner));
        pairs
            .map(|(angles, (own, partner))| {
                let mixed = self.mix(angles, &constant(own), &constant(partner));
                mixed.map(|dual| dual.value)
            })
            .collect()
    }
}

impl Material for TaskMaterial {
    fn name(&self) -> &str {
        self.materials[self.task.material].name()
    }

    fn with_derivatives(&self, angles: &[Angles<f32>]) -> Vec<BrdfWithDerivative> {
        let parts = self.parts();
        let [own, partner] = parts.map(|(material, warp)| evaluate_warped(material, warp, angles));
        let pairs = angles.iter().zip(own.iter().zip(&partner));
        pairs
            .map(|(angles, (own, partner))| {
                let mixed = self.mix(*angles, own, partner);
                (mixed.map(|dual| dual.value), mixed.map(|dual| dual.tangent))
            })
            .collect()
    }
}
