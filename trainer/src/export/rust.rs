//! A recipe as Rust source: for firmware that wants its constants as plain arrays.

use std::fmt::Write;

use glimpse_core::recipe::Recipe;

/// A module of constants; floats are written so that they read back to the same bits.
#[must_use]
pub fn to_rust(recipe: &Recipe<'_>) -> String {
    let provenance = recipe.provenance();
    let mut source = format!(
        "//! Recipe {:08x}: {} at n = {}, by {}.\n\
         //! Trained on {} ({} materials), {}, seed {}.\n\
         //! Expected loss on an unseen material: {:.4}.\n\n",
        recipe.checksum(),
        recipe.model(),
        recipe.samples(),
        provenance.trainer,
        provenance.data,
        provenance.materials,
        provenance.schedule,
        provenance.seed,
        recipe.expected_loss(),
    );
    let mut constant = |documentation: &str, declaration: &str, body: &str| {
        // Writing to a String cannot fail.
        let _ = writeln!(
            source,
            "/// {documentation}\npub const {declaration} = {body};\n"
        );
    };
    constant(
        "Steps of SGD.",
        "INNER_STEPS: u16",
        &recipe.inner_steps().to_string(),
    );
    let rows: Vec<String> = recipe
        .pattern()
        .map(|a| format!("    [{:?}, {:?}, {:?}],\n", a.theta_h, a.theta_d, a.phi_d))
        .collect();
    constant(
        "Where to measure: theta_h, theta_d and phi_d in radians.",
        &format!("PATTERN: [[f32; 3]; {}]", recipe.samples()),
        &format!("[\n{}]", rows.concat()),
    );
    for (documentation, name, values) in [
        (
            "Initial parameters, in the model's order.",
            "INITIAL",
            recipe.initial(),
        ),
        (
            "A step size for each parameter.",
            "STEP_SIZES",
            recipe.step_sizes(),
        ),
    ] {
        let list: Vec<f32> = values.iter().collect();
        let rows: Vec<String> = list
            .chunks(8)
            .map(|row| {
                let row: Vec<String> = row.iter().map(|value| format!("{value:?}")).collect();
                format!("    {},\n", row.join(", "))
            })
            .collect();
        constant(
            documentation,
            &format!("{name}: [f32; {}]", list.len()),
            &format!("[\n{}]", rows.concat()),
        );
    }
    source.truncate(source.trim_end().len());
    source.push('\n');
    source
}
