//! What a recipe promises, always with the materials that it was found on.

use glimpse_core::recipe::Expectation;

/// How the list of materials ends if they are those of training themselves.
const TRAINED_ON: &str = "that it was trained on";

/// The loss to expect, in words that begin with the number.
pub(super) fn promise(expectation: Expectation<'_>) -> String {
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
    let caution = match on.ends_with(TRAINED_ON) {
        true => ": of unseen materials nothing is known",
        false => "; materials of another kind may lose more",
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
            promise(Expectation {
                loss: 0.0125,
                standard_error: (materials > 1).then_some(0.0015),
                materials,
                on,
            })
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
}
