//! `trainer inspect`

use std::path::PathBuf;

use clap::Args;
use glimpse_core::fit::Estimator;
use glimpse_core::recipe::Recipe;
use glimpse_fitting::export::to_json;
use glimpse_fitting::measurement::NamedRecipe;
use glimpse_fitting::recipe::options::TrainingOptions;
use glimpse_fitting::recipe::{Metadata, MetadataError};
use glimpse_fitting::route::{Order, Route, arms_in_degrees};
use glimpse_materials::Identity;
use glimpse_materials::setting::Name;

use super::expected_loss::expected_loss;
use super::limits::describe;
use super::{print, print_json};

/// Print a recipe: model, memory, expected loss, limits, training and pattern.
///
/// The pattern is listed as angles of the half and difference vectors, and as positions of the arms.
/// `memory` is the memory of a scan in words of 4 bytes. `trainer render pattern` plots the pattern,
/// and `trainer plan` orders it.
#[derive(Args)]
pub(crate) struct Inspect {
    /// Recipe file, or the name of a bundled recipe
    recipe: PathBuf,
    /// Print the whole recipe as JSON, like export --format json
    #[arg(long)]
    json: bool,
}

impl Inspect {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        let file = NamedRecipe::read_file(&self.recipe)?;
        let recipe = file.recipe();
        if self.json {
            return print_json(&to_json(&file)?);
        }
        let mut text = format!(
            "recipe {:08x}, {} bytes\n{}memory         {} words\n{}",
            recipe.checksum(),
            file.bytes().len(),
            describe_estimator(&recipe),
            recipe.memory_words(),
            describe_metadata(&recipe, file.metadata())?,
        );
        if recipe.samples() > 0 {
            text += "\nsample  theta_h  theta_d    phi_d  theta_i    phi_i  theta_o    phi_o  (degrees)\n";
        }
        for (index, angles) in recipe.pattern().enumerate() {
            let [theta_i, phi_i, theta_o, phi_o] = arms_in_degrees(angles).to_array();
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

/// Describes the model, the samples, and the stages of the fit, one a line.
fn describe_estimator(recipe: &Recipe<'_>) -> String {
    let samples = match (recipe.samples(), recipe.tolerates_missing()) {
        (0, _) => "readings at any directions, without a pattern".to_owned(),
        (count, true) => format!("{count}; any reading may be missing"),
        (count, false) => format!("{count}; all readings are needed"),
    };
    let fit = match recipe.estimator() {
        Estimator::Sgd(sgd) => format!(
            "{} steps of SGD for {} parameters",
            sgd.steps,
            sgd.initial.len()
        ),
        Estimator::Ridge {
            coefficients,
            refinement,
            ..
        } => {
            let net = coefficients.net.map_or("", |_| "net, ");
            let steps = refinement.as_ref().map_or(String::new(), |refinement| {
                format!(", start, {} Gauss-Newton steps", refinement.steps.steps)
            });
            let components = coefficients.components();
            format!("{net}ridge with {components} components{steps}")
        }
    };
    format!(
        "model          {}\nsamples        {samples}\nfit            {fit}\n",
        recipe.model(),
    )
}

/// Describes the time of a scan, on the machine that the recipe was trained for.
fn describe_scan(recipe: &Recipe<'_>, metadata: &Metadata) -> String {
    let machine = metadata.machine();
    let Some(route) = Route::of_recipe(recipe, &machine, Order::Travel) else {
        return "some samples exceed the limits".to_owned();
    };
    let trained = match metadata.scan_seconds() {
        Some(seconds) => format!("; trained for at most {seconds} seconds"),
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
            match recipe.samples() {
                0 => "depends on the directions; `trainer evaluate --geometry` measures it"
                    .to_owned(),
                _ => expected_loss(recipe)?.unwrap_or_else(unstated),
            },
        ),
        ("limits", metadata.limits().map_or_else(unstated, describe)),
        (
            "scan",
            match recipe.samples() {
                0 => "depends on the directions".to_owned(),
                _ => describe_scan(recipe, metadata),
            },
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
                format!(
                    "{}, seed {}",
                    training.describe_schedule(),
                    training.options.seed
                ),
            ),
            ("options", describe_options(&training.options)),
            ("trainer", training.trainer.clone()),
        ]),
    }
    lines.push(("materials", describe_materials(&metadata.materials)));
    let stated = lines.iter().filter(|(_, text)| !text.is_empty());
    Ok(stated
        .map(|(name, text)| format!("{name:15}{text}\n"))
        .collect())
}

/// Describes the options that differ from their defaults, and are not described elsewhere.
fn describe_options(options: &TrainingOptions) -> String {
    let defaults = TrainingOptions {
        parts: options.parts.clone(),
        pattern: options.pattern.clone(),
        source_shares: options.source_shares.clone(),
        ..TrainingOptions::new(
            options.model,
            options.samples,
            options.schedule,
            options.effort,
            options.seed,
        )
    };
    let differences = options.differences(&defaults).into_iter();
    let texts = differences.map(|(name, value)| format!("{} {value}", Name(&name)));
    texts.collect::<Vec<_>>().join(", ")
}

fn describe_materials(materials: &[Identity]) -> String {
    if materials.is_empty() {
        return "not named".to_owned();
    }
    let names = materials.iter().take(MAX_NAMES);
    let names: Vec<&str> = names.map(|material| &material.name[..]).collect();
    let more = if materials.len() > MAX_NAMES {
        ", ..."
    } else {
        ""
    };
    format!("{}: {}{more}", materials.len(), names.join(", "))
}
