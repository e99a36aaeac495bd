//! Checks of messages that do not depend on their wording.

/// Asserts that a message contains options, files, columns or numbers, each as a separate word.
pub(crate) fn assert_names(message: &str, identifiers: &[&str]) {
    let is_word = |letter: Option<char>| letter.is_some_and(|c| c.is_alphanumeric() || c == '_');
    for identifier in identifiers {
        let (first, last) = (identifier.chars().next(), identifier.chars().next_back());
        let is_present = message.match_indices(identifier).any(|(start, _)| {
            let (before, behind) = (&message[..start], &message[start + identifier.len()..]);
            let joined_before = is_word(before.chars().next_back()) && is_word(first);
            let joined_behind = is_word(behind.chars().next()) && is_word(last);
            !joined_before && !joined_behind
        });
        assert!(is_present, "no {identifier} in {message}");
    }
}
