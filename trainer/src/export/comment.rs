//! Recipe metadata as text for comments in exported source code.

use glimpse_core::recipe::ExpectedLoss;

/// Makes a text safe inside a comment: each control character, such as a line break, becomes a space, and `*/` becomes
/// `* /`.
pub(super) fn comment_text(text: &str) -> String {
    let line: String = text
        .chars()
        .map(|character| {
            if character.is_control() {
                ' '
            } else {
                character
            }
        })
        .collect();
    line.replace("*/", "* /")
}

/// Describes the expected loss and the materials on which it was measured.
pub(super) fn expected_loss_text(expected_loss: &ExpectedLoss<'_>) -> String {
    let ExpectedLoss {
        loss,
        materials,
        on,
        ..
    } = expected_loss;
    match materials {
        0 => format!("Expected loss: {loss:.4}, on unstated materials."),
        _ => format!(
            "Expected loss: {loss:.4}, measured on {materials} {}.",
            comment_text(on)
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comment_text_cannot_end_the_comment() {
        assert_eq!(comment_text("a\nfn b() {}\r*/ c"), "a fn b() {} * / c");
        let text_for = |materials| {
            expected_loss_text(&ExpectedLoss {
                loss: 0.0125,
                standard_error: None,
                materials,
                on: "materials\nof MERL",
            })
        };
        let stated = text_for(7);
        assert!(
            stated.contains("0.0125") && stated.contains('7') && !stated.contains('\n'),
            "{stated}"
        );
        assert!(text_for(0).contains("0.0125"));
    }
}
