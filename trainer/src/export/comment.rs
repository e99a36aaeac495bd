//! What a recipe states about itself, for a comment of source code.

use glimpse_core::recipe::ExpectedLoss;

/// A text that ends no comment: one line, without the end of one in C.
pub(super) fn in_comment(text: &str) -> String {
    let line: String = text
        .chars()
        .map(|letter| if letter.is_control() { ' ' } else { letter })
        .collect();
    line.replace("*/", "* /")
}

/// The loss to expect, and on what it was found.
pub(super) fn expected(expectation: &ExpectedLoss<'_>) -> String {
    let ExpectedLoss {
        loss,
        materials,
        on,
        ..
    } = expectation;
    match materials {
        0 => format!("Expected loss: {loss:.4}, on what is not stated."),
        _ => format!(
            "Expected loss: {loss:.4}, found on {materials} {}.",
            in_comment(on)
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_ends_its_comment() {
        assert_eq!(in_comment("a\nfn b() {}\r*/ c"), "a fn b() {} * / c");
        let of = |materials| {
            expected(&ExpectedLoss {
                loss: 0.0125,
                standard_error: None,
                materials,
                on: "materials\nof MERL",
            })
        };
        let stated = of(7);
        assert!(
            stated.contains("0.0125") && stated.contains('7') && !stated.contains('\n'),
            "{stated}"
        );
        assert!(of(0).contains("0.0125"));
    }
}
