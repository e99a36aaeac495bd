//! `trainer inspect`

use std::path::PathBuf;

use clap::Args;
use glimpse_core::angles::HalfDifference;
use glimpse_trainer::export::RecipeFile;

use super::print;

/// Show what is in a recipe: model, where it came from, and where it measures.
#[derive(Args)]
pub(crate) struct Inspect {
    /// The recipe file
    recipe: PathBuf,
}

impl Inspect {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        let file = RecipeFile::read(&self.recipe)?;
        let recipe = file.recipe()?;
        let provenance = recipe.provenance();
        let mut step_sizes: Vec<f32> = recipe.step_sizes().iter().collect();
        step_sizes.sort_by(f32::total_cmp);
        let quantile = |share: f32| {
            let index = (share * (step_sizes.len() - 1) as f32).round() as usize;
            step_sizes.get(index).copied().unwrap_or_default()
        };
        let mut text = format!(
            "recipe {:08x}, {} bytes\n\
             model          {} ({} parameters)\n\
             samples        {}\n\
             inner steps    {}\n\
             step sizes     {:.2e} to {:.2e}, median {:.2e}\n\
             expected loss  {:.4} on an unseen material\n\
             trained on     {} ({} materials)\n\
             schedule       {}, seed {}\n\
             by             {}\n\n\
             sample  theta_h  theta_d    phi_d  theta_i  theta_o  (degrees)\n",
            recipe.checksum(),
            file.bytes().len(),
            recipe.model(),
            recipe.model().parameters(),
            recipe.samples(),
            recipe.inner_steps(),
            quantile(0.0),
            quantile(1.0),
            quantile(0.5),
            recipe.expected_loss(),
            provenance.data,
            provenance.materials,
            provenance.schedule,
            provenance.seed,
            provenance.trainer,
        );
        for (index, angles) in recipe.pattern().enumerate() {
            let at = HalfDifference::from_angles(angles);
            text += &format!(
                "{index:6} {:8.2} {:8.2} {:8.2} {:8.2} {:8.2}\n",
                angles.theta_h.to_degrees(),
                angles.theta_d.to_degrees(),
                angles.phi_d.to_degrees(),
                at.cos_theta_i().acos().to_degrees(),
                at.cos_theta_o().acos().to_degrees(),
            );
        }
        print(&text)
    }
}
