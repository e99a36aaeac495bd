//! A recipe as Rust source: for firmware that wants its constants as plain arrays.

use std::fmt::Write;

use glimpse_core::recipe::{Descent, Floats, Learner, Recipe, RecipeError, Ridge};

/// A module of constants; floats are written so that they read back to the same bits.
///
/// # Errors
/// If what it states about itself makes no sense.
pub fn to_rust(recipe: &Recipe<'_>) -> Result<String, RecipeError> {
    let statements = recipe.statements()?;
    let mut source = format!(
        "//! Recipe {:08x}: {} at n = {}.\n",
        recipe.checksum(),
        recipe.model(),
        recipe.samples(),
    );
    if let Some(provenance) = statements.provenance {
        source += &format!(
            "//! By {}, trained on {} ({} materials), {}, seed {}.\n",
            provenance.trainer,
            provenance.data,
            provenance.materials,
            provenance.schedule,
            provenance.seed,
        );
    }
    if let Some(expectation) = statements.expectation {
        let loss = expectation.loss;
        source += &format!("//! Expected loss on an unseen material: {loss:.4}.\n");
    }
    source.push('\n');
    if let Learner::Descent(descent) = recipe.learner() {
        let steps = descent.inner_steps().to_string();
        constant(&mut source, "Steps of SGD.", "INNER_STEPS: u16", &steps);
    }
    let rows: Vec<f32> = recipe
        .pattern()
        .flat_map(|a| [a.theta_h, a.theta_d, a.phi_d])
        .collect();
    table(
        &mut source,
        "Where to measure: theta_h, theta_d and phi_d in radians.",
        "PATTERN",
        &rows,
        3,
    );
    match recipe.learner() {
        Learner::Descent(descent) => add_descent(&mut source, &descent),
        Learner::Ridge(ridge) => add_ridge(&mut source, &ridge),
    }
    source.truncate(source.trim_end().len());
    source.push('\n');
    Ok(source)
}

fn add_descent(source: &mut String, descent: &Descent<'_>) {
    list(
        source,
        "Initial parameters, in the model's order.",
        "INITIAL",
        descent.initial(),
    );
    list(
        source,
        "A step size for each parameter.",
        "STEP_SIZES",
        descent.step_sizes(),
    );
}

fn add_ridge(source: &mut String, ridge: &Ridge<'_>) {
    let basis: Vec<f32> = ridge.basis().iter().collect();
    table(
        source,
        "The components at the directions of `PATTERN`, a row for each.",
        "BASIS",
        &basis,
        ridge.components(),
    );
    for (documentation, name, floats) in [
        (
            "The mean of the mapped training columns there.",
            "MEAN",
            ridge.mean(),
        ),
        (
            "The median BRDF there, sr^-1 (not times a cosine).",
            "MEDIAN",
            ridge.median(),
        ),
        ("cos(theta_i) cos(theta_o) there.", "WEIGHT", ridge.weight()),
        (
            "The precision of each coefficient.",
            "PRECISION",
            ridge.precision(),
        ),
    ] {
        list(source, documentation, name, floats);
    }
    constant(
        source,
        "The CRC-32 of the file of the whole basis; 0 if there is none.",
        "BASIS_CHECKSUM: u32",
        &format!("{:#010x}", ridge.basis_checksum().unwrap_or_default()),
    );
}

fn constant(source: &mut String, documentation: &str, declaration: &str, body: &str) {
    // Writing to a String cannot fail.
    let _ = writeln!(
        source,
        "/// {documentation}\npub const {declaration} = {body};\n"
    );
}

/// Rows of so many numbers.
fn table(source: &mut String, documentation: &str, name: &str, values: &[f32], columns: usize) {
    let rows: Vec<String> = values
        .chunks(columns)
        .map(|row| format!("    [{}],\n", joined(row)))
        .collect();
    constant(
        source,
        documentation,
        &format!("{name}: [[f32; {columns}]; {}]", rows.len()),
        &format!("[\n{}]", rows.concat()),
    );
}

fn list(source: &mut String, documentation: &str, name: &str, floats: Floats<'_>) {
    let list: Vec<f32> = floats.iter().collect();
    let rows: Vec<String> = list
        .chunks(8)
        .map(|row| format!("    {},\n", joined(row)))
        .collect();
    constant(
        source,
        documentation,
        &format!("{name}: [f32; {}]", list.len()),
        &format!("[\n{}]", rows.concat()),
    );
}

fn joined(row: &[f32]) -> String {
    let row: Vec<String> = row.iter().map(|value| format!("{value:?}")).collect();
    row.join(", ")
}
