//! `trainer inspect`

use std::path::PathBuf;

use clap::Args;
use glimpse_core::fit::Target;
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::{Completed, Descent, FitMethod, Floats, Recipe, Ridge};
use glimpse_materials::Identity;
use glimpse_trainer::export::{eta, to_json};
use glimpse_training::recipe::{Metadata, MetadataError, Noise, RecipeFile};
use glimpse_training::route::{Machine, Order, Route, axes_from_angles};

use super::expected_loss::expected_loss;
use super::limits::describe;
use super::print;

/// Print a recipe: model, memory, expected loss, limits, training and pattern.
///
/// The pattern is listed as angles of the half and difference vectors, and as positions of the arms.
/// `memory` is the memory of a scan in words of 4 bytes. `trainer render pattern` plots the pattern,
/// and `trainer plan` orders it.
#[derive(Args)]
pub(crate) struct Inspect {
    /// Recipe file
    recipe: PathBuf,
    /// Print the whole recipe as JSON, like export --format json
    #[arg(long)]
    json: bool,
}

impl Inspect {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        let file = RecipeFile::read(&self.recipe)?;
        let recipe = file.recipe();
        if self.json {
            return print(&(serde_json::to_string_pretty(&to_json(&recipe)?)? + "\n"));
        }
        let mut text = format!(
            "recipe {:08x}, {} bytes\n{}memory         {} words\n{}\n\
             sample  theta_h  theta_d    phi_d  theta_i    phi_i  theta_o    phi_o  (degrees)\n",
            recipe.checksum(),
            file.bytes().len(),
            match recipe.method() {
                FitMethod::Descent(descent) => describe_descent(&descent, recipe.samples()),
                FitMethod::Ridge(ridge) => describe_ridge(&ridge, recipe.samples()),
                FitMethod::Completed(completed) => describe_completed(&completed, recipe.samples()),
            },
            recipe.memory_words(),
            describe_metadata(&recipe, file.metadata())?,
        );
        for (index, angles) in recipe.pattern().enumerate() {
            let [theta_i, phi_i, theta_o, phi_o] = axes_from_angles(angles).to_array();
            text += &format!(
                "{index:6} {:8.2} {:8.2} {:8.2} {theta_i:8.2} {phi_i:8.2} {theta_o:8.2} {phi_o:8.2}\n",
                angles.theta_h.to_degrees(),
                angles.theta_d.to_degrees(),
                angles.phi_d.to_degrees(),
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
        range_and_median(descent.step_sizes()),
    )
}

fn describe_ridge(ridge: &Ridge<'_>, samples: usize) -> String {
    let precision = match eta(ridge) {
        Some(eta) => format!("{eta} for every coefficient"),
        None => range_and_median(ridge.precision()),
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

fn describe_completed(completed: &Completed<'_>, samples: usize) -> String {
    let net = completed.coefficient_net();
    let missing = match completed.tolerates_missing() {
        true => "any reading may be missing",
        false => "all readings are needed",
    };
    let uncertainty = match completed.uncertainty() {
        Some(each) => format!(
            "upper bound of the loss {:.2} times the prediction; innovation to {:.3} is usual; exponents {:.2} and \
             {:.2}",
            each.bound, each.max_innovation, each.innovation, each.residual,
        ),
        None => "none".to_owned(),
    };
    let correction = match completed.correction() {
        Some(correction) => format!(
            "{} components, precision {}",
            correction.components(),
            range_and_median(correction.precision()),
        ),
        None => "none".to_owned(),
    };
    let target = match completed.target() {
        Target::Linear(components) => {
            let basis = components.basis_checksum();
            let basis = basis.map_or_else(|| "none".to_owned(), |basis| format!("{basis:08x}"));
            format!("whole basis    {basis}\n")
        }
        Target::Descent(descent, init_net) => format!(
            "init net       {} units for {} parameters\n\
             inner steps    {}\n\
             step sizes     {}\n",
            init_net.units(),
            descent.initial().len(),
            descent.inner_steps(),
            range_and_median(descent.step_sizes()),
        ),
        Target::GaussNewton(steps, init_net) => format!(
            "init net       {} units for {} parameters\n\
             Gauss-Newton   {} steps, {} virtual readings of weight 1, readings of weight {:.3}, error scale {:.4}\n\
             precision      {}\n",
            init_net.units(),
            steps.initial().len(),
            steps.steps(),
            steps.virtual_readings().len(),
            steps.reading_weight(),
            steps.error_scale(),
            range_and_median(steps.precision()),
        ),
    };
    format!(
        "model          {} (completed)\n\
         samples        {samples}; {missing}\n\
         completion     {} components, {} hidden units\n\
         correction     {correction}\n\
         uncertainty    {uncertainty}\n\
         {target}",
        completed.model(),
        net.components,
        net.hidden(),
    )
}

/// Describes the time of a scan, on the machine that the recipe was trained for.
fn describe_scan(recipe: &Recipe<'_>, metadata: &Metadata) -> String {
    let machine = Machine::of_recipe(metadata);
    let Some(route) = Route::of_recipe(recipe, Order::Travel) else {
        return "some samples exceed the limits".to_owned();
    };
    let trained = match metadata.scan_budget {
        Some(budget) => format!("; trained for at most {} seconds", budget.seconds),
        None => String::new(),
    };
    format!(
        "{:.1} seconds, including {:.1} of motion, at {} degrees/s with {} seconds at each sample{trained}",
        route.total(),
        route.travel,
        machine
            .speeds
            .to_array()
            .map(|speed| speed.to_string())
            .join(","),
        machine.settle,
    )
}

/// Maximum number of printed names of training materials.
const MAX_NAMES: usize = 3;

/// Describes the recipe's metadata, one item a line.
fn describe_metadata(recipe: &Recipe<'_>, metadata: &Metadata) -> Result<String, MetadataError> {
    let unstated = || "not stated".to_owned();
    let mut lines = vec![
        (
            "expected loss",
            expected_loss(recipe)?.unwrap_or_else(unstated),
        ),
        ("limits", metadata.limits.map_or_else(unstated, describe)),
        ("scan", describe_scan(recipe, metadata)),
        (
            "noise",
            metadata.noise.map_or_else(unstated, describe_noise),
        ),
    ];
    match &metadata.training {
        None => lines.push(("trained on", unstated())),
        Some(training) => lines.extend([
            (
                "trained on",
                format!("{} ({} materials)", training.data, training.materials),
            ),
            (
                "schedule",
                format!("{}, seed {}", training.describe_schedule(), training.seed),
            ),
            ("options", training.options.clone()),
            ("trainer", training.trainer.clone()),
        ]),
    }
    lines.push(("materials", describe_materials(&metadata.materials)));
    lines.extend(
        recipe
            .sections()
            .filter_map(|(kind, bytes)| match kind.name() {
                Some(_) => None,
                None => Some(("unknown", format!("section {kind}, {} bytes", bytes.len()))),
            }),
    );
    let stated = lines.iter().filter(|(_, text)| !text.is_empty());
    Ok(stated
        .map(|(name, text)| format!("{name:15}{text}\n"))
        .collect())
}

fn describe_noise(noise: Noise) -> String {
    let levels = match noise.levels {
        0 => String::new(),
        levels => format!(", {levels} levels"),
    };
    format!(
        "{} of the value and {} sr^-1 (standard deviations){levels}",
        noise.multiplicative, noise.additive
    )
}

fn describe_materials(materials: &[Identity]) -> String {
    let count = materials.len();
    let names = materials.iter().take(MAX_NAMES);
    let names: Vec<&str> = names.map(|each| &each.name[..]).collect();
    match count {
        0 => "not named".to_owned(),
        _ if count > MAX_NAMES => format!("{count}: {}, ...", names.join(", ")),
        _ => format!("{count}: {}", names.join(", ")),
    }
}

/// Describes the smallest, largest and median value of a list.
fn range_and_median(floats: Floats<'_>) -> String {
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
