//! `trainer inspect`

use std::path::PathBuf;

use clap::Args;
use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{Descent, Floats, Learner, Ridge};
use glimpse_trainer::export::{RecipeFile, eta};

use super::print;

/// Show what is in a recipe: model, where it came from, and where it measures.
///
/// `trainer render pattern` draws where it measures.
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
        let mut text = format!(
            "recipe {:08x}, {} bytes\n{}\
             expected loss  {:.4} on an unseen material\n\
             trained on     {} ({} materials)\n\
             schedule       {}, seed {}\n\
             by             {}\n\n\
             sample  theta_h  theta_d    phi_d  theta_i  theta_o  (degrees)\n",
            recipe.checksum(),
            file.bytes().len(),
            match recipe.learner() {
                Learner::Descent(descent) => describe_descent(&descent, recipe.samples()),
                Learner::Ridge(ridge) => describe_ridge(&ridge, recipe.samples()),
            },
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

fn describe_descent(descent: &Descent<'_>, samples: usize) -> String {
    format!(
        "model          {} ({} parameters)\n\
         samples        {samples}\n\
         inner steps    {}\n\
         step sizes     {}\n",
        descent.model(),
        descent.initial().len(),
        descent.inner_steps(),
        spread(descent.step_sizes()),
    )
}

fn describe_ridge(ridge: &Ridge<'_>, samples: usize) -> String {
    let precision = match eta(ridge) {
        Some(eta) => format!("{eta} for every coefficient"),
        None => spread(ridge.precision()),
    };
    let basis = match ridge.basis_checksum() {
        Some(checksum) => format!("{checksum:08x}"),
        None => "none".to_owned(),
    };
    format!(
        "model          {} ({} components)\n\
         samples        {samples}\n\
         precision      {precision}\n\
         whole basis    {basis}\n",
        ModelKind::Linear,
        ridge.components(),
    )
}

/// Smallest, largest and median of a list.
fn spread(floats: Floats<'_>) -> String {
    let mut list: Vec<f32> = floats.iter().collect();
    list.sort_by(f32::total_cmp);
    let quantile = |share: f32| {
        let index = (share * (list.len() - 1) as f32).round() as usize;
        list.get(index).copied().unwrap_or_default()
    };
    format!(
        "{:.2e} to {:.2e}, median {:.2e}",
        quantile(0.0),
        quantile(1.0),
        quantile(0.5)
    )
}
