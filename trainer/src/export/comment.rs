//! Recipe metadata as text for comments in exported source code.

use glimpse_training::recipe::Metadata;

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

/// Describes an expected loss and the materials on which it was measured.
pub(super) fn expected_loss_text(loss: f32, metadata: &Metadata) -> String {
    let materials = metadata.validation_materials();
    match metadata.expected_loss.zip(materials) {
        None => format!("Expected loss: {loss:.4}, on unstated materials."),
        Some((expected, materials)) => format!(
            "Expected loss: {loss:.4}, measured on {} {}.",
            expected.estimate.materials,
            comment_text(&materials)
        ),
    }
}

#[cfg(test)]
mod tests {
    use glimpse_core::model::ModelKind;
    use glimpse_training::meta::learned::{ValidatedLoss, ValidationSplit};
    use glimpse_training::meta::objective::LossEstimate;
    use glimpse_training::meta::options::Options;
    use glimpse_training::meta::plan::{Effort, Schedule};
    use glimpse_training::recipe::Training;

    use super::*;

    #[test]
    fn comment_text_cannot_end_the_comment() {
        assert_eq!(comment_text("a\nfn b() {}\r*/ c"), "a fn b() {} * / c");
        let options = Options::new(ModelKind::Phong, 2, Schedule::Joint, Effort::Brief, 0);
        let metadata = Metadata {
            training: Some(Training::new(&options, "MERL\nand others", 7)),
            expected_loss: Some(ValidatedLoss {
                estimate: LossEstimate::new(0.0125, [0.0125; 7].into_iter()),
                split: ValidationSplit::Folds,
            }),
            ..Metadata::default()
        };
        let stated = expected_loss_text(0.0125, &metadata);
        assert!(
            stated.contains("0.0125") && stated.contains('7') && !stated.contains('\n'),
            "{stated}"
        );
        assert!(expected_loss_text(0.0125, &Metadata::default()).contains("0.0125"));
    }
}
