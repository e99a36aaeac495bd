//! What a recipe promises, always with the materials that it was found on.

use glimpse_core::recipe::{Expectation, Provenance, Recipe, RecipeError};
use glimpse_trainer::material::Source;
use glimpse_trainer::shipped;

/// How the list of materials ends if they are those of training themselves.
const TRAINED_ON: &str = "that it was trained on";

/// The loss that a recipe promises, in words that begin with the number; None if it states none.
pub(super) fn promise(recipe: &Recipe<'_>) -> Result<Option<String>, RecipeError> {
    let caution = caution(recipe)?;
    let expectation = recipe.statements()?.expectation;
    Ok(expectation.map(|expectation| in_words(expectation, caution.as_deref())))
}

/// What a recipe of built-in materials alone, which knows of no others, says too little of; None of others.
pub(super) fn caution(recipe: &Recipe<'_>) -> Result<Option<String>, RecipeError> {
    let provenance = recipe.statements()?.provenance;
    if !provenance.is_some_and(|provenance| is_built_in(&provenance)) {
        return Ok(None);
    }
    let losses = shipped::find_by_checksum(recipe.checksum()).and_then(|shipped| shipped.losses());
    let measured = match losses {
        Some(losses) => format!(
            "loses {:.4} on 80 of MERL's and {:.4} on 17 of RGL's, in the mean",
            losses.merl, losses.rgl
        ),
        None => "measured ones may lose several times as much".to_owned(),
    };
    Ok(Some(format!(
        "but it was trained on built-in materials alone, and {measured}"
    )))
}

/// True if no material came from a file.
fn is_built_in(provenance: &Provenance<'_>) -> bool {
    // Several sources have " and " between them, and each its share behind it.
    let mut labels = provenance.data.split(" and ").map(|label| {
        let name = label.split(" (").next();
        name.unwrap_or_default()
    });
    labels.all(|label| {
        label
            .parse::<Source>()
            .is_ok_and(|source| source.is_built_in())
    })
}

fn in_words(expectation: Expectation<'_>, caution: Option<&str>) -> String {
    let Expectation {
        loss,
        standard_error,
        materials,
        on,
    } = expectation;
    let error = match standard_error {
        Some(error) => format!(" (standard error {error:.4})"),
        None => String::new(),
    };
    if materials == 0 {
        return format!("{loss:.4}{error}, on what is not stated");
    }
    let caution = match (on.ends_with(TRAINED_ON), caution) {
        (true, _) => ": of unseen materials nothing is known".to_owned(),
        (false, Some(caution)) => format!(", {caution}"),
        (false, None) => "; materials of another kind may lose more".to_owned(),
    };
    let on = match on.strip_prefix("materials") {
        Some(rest) if materials == 1 => format!("material{rest}"),
        _ => on.to_owned(),
    };
    format!("{loss:.4}{error}, found on {materials} {on}{caution}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_it_was_found_on_is_always_said() {
        let told = |materials, on| {
            let expectation = Expectation {
                loss: 0.0125,
                standard_error: (materials > 1).then_some(0.0015),
                materials,
                on,
            };
            in_words(expectation, None)
        };
        assert_eq!(
            told(7, "materials of MERL held out of training"),
            "0.0125 (standard error 0.0015), found on 7 materials of MERL held out of training; \
             materials of another kind may lose more"
        );
        assert_eq!(
            told(1, "materials of MERL that it was trained on"),
            "0.0125, found on 1 material of MERL that it was trained on: of unseen materials \
             nothing is known"
        );
        assert_eq!(told(0, ""), "0.0125, on what is not stated");
    }

    #[test]
    fn what_knows_of_built_in_materials_alone_says_so() {
        let said = |data| {
            is_built_in(&Provenance {
                trainer: "",
                data,
                materials: 1,
                schedule: "",
                seed: 0,
                options: "",
            })
        };
        assert!(said("procedural:400") && said("procedural:1 and procedural:2:8"));
        assert!(said("procedural:1 (0.250) and procedural:2:8 (0.750)"));
        assert!(!said("MERL") && !said("procedural:1 and MERL") && !said(""));

        let shipped = shipped::find("neural-n8").unwrap();
        let recipe = shipped.recipe().unwrap();
        let losses = shipped.losses().unwrap();
        let told = promise(&recipe).unwrap().unwrap();
        let figure = format!("alone, and loses {:.4} on 80 of MERL's", losses.merl);
        assert!(told.contains(&figure), "{told}");
    }
}
