//! Export of a recipe as Rust source with plain arrays.

use std::fmt::Write;

use glimpse_core::fit::coefficient_net::MissingPolicy;
use glimpse_core::fit::gauss_newton::GaussNewton;
use glimpse_core::fit::{InitNet, Target};
use glimpse_core::recipe::{Completed, Descent, FitMethod, Floats, Ridge};
use glimpse_training::recipe::RecipeFile;

use super::comment::{comment_text, expected_loss_text};

/// Returns the source of a Rust module of constants. Floats have enough digits to restore their exact bits.
#[must_use]
pub fn to_rust(file: &RecipeFile) -> String {
    let (recipe, metadata) = (file.recipe(), file.metadata());
    let mut source = format!(
        "//! Recipe {:08x}: {} at n = {}.\n",
        recipe.checksum(),
        recipe.model(),
        recipe.samples(),
    );
    if let Some(training) = &metadata.training {
        source += &format!(
            "//! By {}, trained on {} ({} materials), {}, seed {}.\n",
            comment_text(&training.trainer),
            comment_text(&training.data),
            training.materials,
            training.describe_schedule(),
            training.seed,
        );
    }
    if let Some(loss) = recipe.expected_loss() {
        source += &format!("//! {}\n", expected_loss_text(loss, metadata));
    }
    source.push('\n');
    let method = recipe.method();
    let descent = match &method {
        FitMethod::Descent(descent) => Some(descent),
        FitMethod::Completed(completed) => match completed.target() {
            Target::Descent(descent, _) => Some(descent),
            Target::Linear(_) | Target::GaussNewton(..) => None,
        },
        FitMethod::Ridge(_) => None,
    };
    if let Some(descent) = descent {
        let steps = descent.inner_steps().to_string();
        add_constant(&mut source, "Steps of SGD.", "INNER_STEPS: u16", &steps);
    }
    let rows: Vec<f32> = recipe
        .pattern()
        .flat_map(|a| [a.theta_h, a.theta_d, a.phi_d])
        .collect();
    add_table(
        &mut source,
        "The sample directions: theta_h, theta_d and phi_d in radians.",
        "PATTERN",
        &rows,
        3,
    );
    match method {
        FitMethod::Descent(descent) => add_descent(&mut source, &descent),
        FitMethod::Ridge(ridge) => add_ridge(&mut source, &ridge),
        FitMethod::Completed(completed) => add_completed(&mut source, &completed),
    }
    source.truncate(source.trim_end().len());
    source.push('\n');
    source
}

fn add_descent(source: &mut String, descent: &Descent<'_>) {
    add_list(
        source,
        "Initial parameters, in the model's order.",
        "INITIAL",
        descent.initial(),
    );
    add_list(
        source,
        "A step size for each parameter.",
        "STEP_SIZES",
        descent.step_sizes(),
    );
}

fn add_completed(source: &mut String, completed: &Completed<'_>) {
    let completion = completed.coefficient_net();
    let (samples, rows) = (completed.center().len(), completion.rows());
    let size = format!("{samples} x 3 x {rows}");
    let readings = format!("The weights own, mean and missing of each sample's reading: {size}.");
    add_bytes(source, &readings, "READINGS", completion.readings);
    add_words(
        source,
        "The scale of each row.",
        "READING_SCALES",
        completion.scales,
    );
    add_words(source, "The bias of each row.", "BIAS", completion.bias);
    let size = format!("{} rows of {}", completion.components, completion.hidden());
    let output = format!("The weights from hidden units to coefficients: {size}.");
    add_bytes(source, &output, "OUTPUT", completion.output);
    add_words(
        source,
        "The scale of each of those rows.",
        "OUTPUT_SCALES",
        completion.output_scales,
    );
    add_list(
        source,
        "The center that is subtracted from each sample's logarithm.",
        "CENTER",
        completed.center(),
    );
    let scale = format!("{:?}", completed.scale());
    add_constant(
        source,
        "The scale of the centered logarithms.",
        "SCALE: f32",
        &scale,
    );
    let missing = completed.tolerates_missing().to_string();
    add_constant(
        source,
        "True if readings may be missing.",
        "TAKES_MISSING: bool",
        &missing,
    );
    let gain = (completed.missing() == MissingPolicy::Scaled).to_string();
    add_constant(
        source,
        "True if readings are multiplied by sqrt(n / k) when k of n are present.",
        "GAIN: bool",
        &gain,
    );
    if !completed.prediction().is_empty() {
        let predicted = "Weights of the expected loss: exp(first number + sum over coefficients of weight times the \
             mean over channels).";
        add_list(source, predicted, "PREDICTION", completed.prediction());
    }
    if let Some(at_samples) = completed.at_samples() {
        let basis = "The components at the directions of `PATTERN`.";
        add_bytes(source, basis, "BASIS", at_samples.rows());
        let scales = "The scale of each component at these directions.";
        add_list(source, scales, "BASIS_SCALES", at_samples.scales());
    }
    if let Some(correction) = completed.correction() {
        let precision = "The precision of each component in the correction.";
        add_list(
            source,
            precision,
            "CORRECTION_PRECISION",
            correction.precision(),
        );
    }
    match completed.target() {
        Target::Linear(components) => {
            add_basis_checksum(source, components.basis_checksum());
        }
        Target::Descent(descent, start) => {
            add_descent(source, descent);
            add_start(source, start);
        }
        Target::GaussNewton(steps, start) => {
            add_steps(source, steps);
            add_start(source, start);
        }
    }
}

fn add_start(source: &mut String, start: &InitNet<'_>) {
    let hidden = "The weights from coefficients to units, one row per unit.";
    add_bytes(source, hidden, "START_HIDDEN", start.hidden);
    let scales = "The scale of each of those rows.";
    add_words(source, scales, "START_HIDDEN_SCALES", start.hidden_scales);
    add_words(source, "The bias of each unit.", "START_BIAS", start.bias);
    let output = "The weights from units to initial parameters, one row per parameter.";
    add_bytes(source, output, "START_OUTPUT", start.output);
    add_words(source, scales, "START_OUTPUT_SCALES", start.output_scales);
}

fn add_steps(source: &mut String, steps: &GaussNewton<'_>) {
    let count = steps.steps().to_string();
    add_constant(
        source,
        "Gauss-Newton steps.",
        "GAUSS_NEWTON_STEPS: u16",
        &count,
    );
    let initial = "Initial parameters, in the model's order.";
    add_list(source, initial, "INITIAL", steps.initial());
    let precision = "The precision of each active parameter of a system.";
    add_list(source, precision, "PRECISION", steps.precision());
    let weight = format!("{:?}", steps.reading_weight());
    let documentation =
        "The sum of the weights of the pattern's readings; that of virtual ones is 1.";
    add_constant(source, documentation, "READING_WEIGHT: f32", &weight);
    let scale = format!("{:?}", steps.error_scale());
    let documentation = "The error at which the weight of a reading is halved.";
    add_constant(source, documentation, "ERROR_SCALE: f32", &scale);
    let readings = steps.virtual_readings();
    let directions = "The directions of virtual readings: theta_h, theta_d and phi_d in radians.";
    add_words(
        source,
        directions,
        "VIRTUAL_DIRECTIONS",
        readings.directions().as_flattened().as_chunks().0,
    );
    let center = "The mean of the mapped training columns at these directions.";
    add_list(source, center, "VIRTUAL_CENTER", readings.center());
    let rows = "The components at these directions.";
    add_bytes(source, rows, "VIRTUAL_ROWS", readings.components().rows());
    let scales = "The scale of each component at these directions.";
    add_list(
        source,
        scales,
        "VIRTUAL_ROW_SCALES",
        readings.components().scales(),
    );
}

/// Adds an array of signed bytes.
fn add_bytes(source: &mut String, documentation: &str, name: &str, values: &[u8]) {
    let rows: Vec<String> = values
        .chunks(16)
        .map(|row| {
            let row: Vec<String> = row
                .iter()
                .map(|byte| byte.cast_signed().to_string())
                .collect();
            format!("    {},\n", row.join(", "))
        })
        .collect();
    let declaration = format!("{name}: [i8; {}]", values.len());
    add_constant(
        source,
        documentation,
        &declaration,
        &format!("[\n{}]", rows.concat()),
    );
}

fn add_words(source: &mut String, documentation: &str, name: &str, values: &[[u8; 4]]) {
    // Never None: the length is a multiple of 4 bytes.
    if let Some(floats) = Floats::new(values.as_flattened()) {
        add_list(source, documentation, name, floats);
    }
}

fn add_basis_checksum(source: &mut String, checksum: Option<u32>) {
    add_constant(
        source,
        "The CRC-32 of the whole basis's file; 0 if there is none.",
        "BASIS_CHECKSUM: u32",
        &format!("{:#010x}", checksum.unwrap_or_default()),
    );
}

fn add_ridge(source: &mut String, ridge: &Ridge<'_>) {
    let basis: Vec<f32> = ridge.basis().iter().collect();
    add_table(
        source,
        "The components at the directions of `PATTERN`, one row per direction.",
        "BASIS",
        &basis,
        ridge.components(),
    );
    for (documentation, name, floats) in [
        (
            "The mean of the mapped training columns at these directions.",
            "MEAN",
            ridge.mean(),
        ),
        (
            "The median BRDF at these directions, sr^-1 (not times a cosine).",
            "MEDIAN",
            ridge.median(),
        ),
        (
            "cos(theta_i) cos(theta_o) at these directions.",
            "WEIGHT",
            ridge.weight(),
        ),
        (
            "The precision of each coefficient.",
            "PRECISION",
            ridge.precision(),
        ),
    ] {
        add_list(source, documentation, name, floats);
    }
    add_basis_checksum(source, ridge.basis_checksum());
}

fn add_constant(source: &mut String, documentation: &str, declaration: &str, body: &str) {
    // Writing to a String cannot fail.
    let _ = writeln!(
        source,
        "/// {documentation}\npub const {declaration} = {body};\n"
    );
}

/// Adds a table with `columns` numbers per row.
fn add_table(source: &mut String, documentation: &str, name: &str, values: &[f32], columns: usize) {
    let rows: Vec<String> = values
        .chunks(columns)
        .map(|row| format!("    [{}],\n", join_floats(row)))
        .collect();
    add_constant(
        source,
        documentation,
        &format!("{name}: [[f32; {columns}]; {}]", rows.len()),
        &format!("[\n{}]", rows.concat()),
    );
}

fn add_list(source: &mut String, documentation: &str, name: &str, floats: Floats<'_>) {
    let list: Vec<f32> = floats.iter().collect();
    let rows: Vec<String> = list
        .chunks(8)
        .map(|row| format!("    {},\n", join_floats(row)))
        .collect();
    add_constant(
        source,
        documentation,
        &format!("{name}: [f32; {}]", list.len()),
        &format!("[\n{}]", rows.concat()),
    );
}

fn join_floats(row: &[f32]) -> String {
    let row: Vec<String> = row.iter().map(|value| format!("{value:?}")).collect();
    row.join(", ")
}
