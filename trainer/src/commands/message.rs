//! Errors in words.

/// An error and its causes, those left out that the one before has said already.
pub(crate) fn message(error: &anyhow::Error) -> String {
    let mut message = String::new();
    for cause in error.chain() {
        let cause = cause.to_string();
        if !message.contains(&cause) {
            let joint = if message.is_empty() { "" } else { ": " };
            message = message + joint + &cause;
        }
    }
    message
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cause_is_told_once() {
        let told = anyhow::anyhow!("cause").context("effect: cause");
        assert_eq!(message(&told), "effect: cause");
        let untold = anyhow::anyhow!("cause").context("effect");
        assert_eq!(message(&untold), "effect: cause");
    }
}
