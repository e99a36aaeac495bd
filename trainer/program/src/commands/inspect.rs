//! `trainer inspect`

use std::path::PathBuf;

use clap::Args;
use glimpse_core::fit::Estimator;
use glimpse_core::gonio::Limits;
use glimpse_core::recipe::Recipe;
use glimpse_fitting::export::to_json;
use glimpse_fitting::measurement::NamedRecipe;
use glimpse_fitting::recipe::options::TrainingOptions;
use glimpse_fitting::recipe::{Metadata, MetadataError};
use glimpse_fitting::route::{Order, Route, arms_in_degrees};
use glimpse_materials::setting::Name;

use super::expected_loss::expected_loss;
use super::limits::describe;
use super::{first_of, print, print_json};

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
        let mut items = describe_estimator(&recipe).to_vec();
        items.push(("memory", format!("{} words", recipe.memory_words())));
        items.extend(describe_metadata(&recipe, file.metadata())?);
        let (checksum, bytes) = (recipe.checksum(), file.bytes().len());
        let mut text = format!("recipe {checksum:08x}, {bytes} bytes\n");
        for (name, item) in items.iter().filter(|(_, item)| !item.is_empty()) {
            text += &format!("{name:15}{item}\n");
        }
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

/// A line of the description: its name and text. A line without text is not printed.
type Item = (&'static str, String);

/// Describes the model, the samples, and the stages of the fit.
fn describe_estimator(recipe: &Recipe<'_>) -> [Item; 3] {
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
    let model = recipe.model().to_string();
    [("model", model), ("samples", samples), ("fit", fit)]
}

/// Describes the time of a scan, on the machine that the recipe was trained for.
fn describe_scan(recipe: &Recipe<'_>, metadata: &Metadata) -> String {
    let machine = metadata.machine();
    // A machine in one plane has no azimuths.
    let axes = 1 + usize::from(machine.limits.in_plane);
    let speeds = machine.speeds.to_array().into_iter().step_by(axes);
    let speeds: Vec<String> = speeds.map(|speed| speed.to_string()).collect();
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
        speeds.join(","),
        machine.settle,
    )
}

/// Returns the items of the recipe's metadata.
fn describe_metadata(recipe: &Recipe<'_>, metadata: &Metadata) -> Result<Vec<Item>, MetadataError> {
    let unstated = || "not stated".to_owned();
    let (loss, scan) = if recipe.samples() == 0 {
        let loss = "depends on the directions; `trainer evaluate --geometry` measures it";
        (loss.to_owned(), "depends on the directions".to_owned())
    } else {
        let loss = expected_loss(recipe)?.unwrap_or_else(unstated);
        (loss, describe_scan(recipe, metadata))
    };
    let limits = match metadata.machine().limits {
        limits if limits == Limits::NONE => unstated(),
        limits => describe(limits),
    };
    let mut items = vec![("expected loss", loss), ("limits", limits), ("scan", scan)];
    if let Some(training) = &metadata.training {
        let (data, options) = (&training.data, &training.options);
        let materials = format!("{data} ({} materials)", training.materials);
        let schedule = format!("{}, seed {}", training.describe_schedule(), options.seed);
        items.push(("trained on", materials));
        items.push(("schedule", schedule));
        items.push(("options", describe_options(options)));
        items.push(("trainer", training.trainer.clone()));
    } else {
        items.push(("trained on", unstated()));
    }
    let names = metadata.materials.iter().map(|material| &material.name[..]);
    let names: Vec<&str> = names.collect();
    let materials = match names.len() {
        0 => "not named".to_owned(),
        count => format!("{count}: {}", first_of(names)),
    };
    items.push(("materials", materials));
    Ok(items)
}

/// Describes the options that differ from their defaults, and are not described elsewhere.
fn describe_options(options: &TrainingOptions) -> String {
    let defaults = TrainingOptions {
        parts: options.parts.clone(),
        pattern: options.pattern.clone(),
        source_shares: options.source_shares.clone(),
        ..options.defaults()
    };
    let differences = options.differences(&defaults).into_iter();
    let texts = differences.map(|(name, value)| format!("{} {value}", Name(&name)));
    texts.collect::<Vec<_>>().join(", ")
}
