//! Errors as text for the terminal.

/// Joins the messages of an error and its causes. A cause whose message is already included is omitted.
pub(crate) fn message(error: &anyhow::Error) -> String {
    let mut message = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if !message.contains(&cause) {
            let separator = if message.is_empty() { "" } else { ": " };
            message = message + separator + &cause;
        }
    }
    message
}

/// Returns the command-line option of a setting.
pub(crate) fn option(name: &str) -> String {
    let name = match name {
        "materials" => "data",
        "settle_seconds" => "settle",
        "full_turns" => "no_full_turns",
        name => name
            .trim_end_matches("_per_second")
            .trim_end_matches("_degrees"),
    };
    format!("--{}", name.replace('_', "-"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn omits_repeated_cause() {
        let repeated = anyhow::anyhow!("cause").context("effect: cause");
        assert_eq!(message(&repeated), "effect: cause");
        let separate = anyhow::anyhow!("cause").context("effect");
        assert_eq!(message(&separate), "effect: cause");
    }
}
