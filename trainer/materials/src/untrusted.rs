//! Untrusted files: bounded reads, and escaped excerpts of their text in messages.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// The largest number of characters of a file's text in a message.
const MAX_CHARACTERS: usize = 120;
/// The largest number of a file's first bytes in a message.
const START_BYTES: usize = 32;

/// Reads all of a file, a pipe or a device, up to `max_bytes` bytes.
///
/// # Errors
/// If the operating system cannot open or read the file, or it is longer.
pub fn read_at_most(path: &Path, max_bytes: u64) -> io::Result<Vec<u8>> {
    let file = File::open(path)?;
    let metadata = file.metadata()?;
    if metadata.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    if metadata.len() > max_bytes {
        return Err(too_long(&metadata.len().to_string(), max_bytes));
    }
    let mut bytes = Vec::new();
    file.take(max_bytes + 1).read_to_end(&mut bytes)?;
    match bytes.len() as u64 > max_bytes {
        true => Err(too_long(&format!("more than {max_bytes}"), max_bytes)),
        false => Ok(bytes),
    }
}

/// Reads up to `max_bytes` bytes at the start of a file.
pub(crate) fn read_head(path: &Path, max_bytes: u64) -> io::Result<Vec<u8>> {
    let mut head = Vec::new();
    File::open(path)?.take(max_bytes).read_to_end(&mut head)?;
    Ok(head)
}

/// Returns true if the first bytes of a file are text with this start that contains one of some words.
pub(crate) fn is_text(head: &[u8], start: &str, words: &[&str]) -> bool {
    let text = String::from_utf8_lossy(head);
    text.starts_with(start) && words.iter().any(|word| text.contains(word))
}

fn too_long(bytes: &str, max_bytes: u64) -> io::Error {
    let message = format!(
        "it has {bytes} bytes, and at most {max_bytes} are valid here; check that it is the right file"
    );
    io::Error::new(io::ErrorKind::InvalidData, message)
}

/// Returns the first 120 characters of a file's text for a message, in one line, with control characters escaped.
pub fn escaped(text: &str) -> String {
    let mut escaped: String = text
        .chars()
        .take(MAX_CHARACTERS)
        .flat_map(|c| match c.is_control() {
            true => c.escape_default().collect::<Vec<char>>(),
            false => vec![c],
        })
        .collect();
    if text.chars().nth(MAX_CHARACTERS).is_some() {
        escaped += "...";
    }
    escaped
}

/// Returns the first bytes of a file for a message, with those escaped that are not ASCII text.
#[must_use]
pub fn escaped_start(bytes: &[u8]) -> String {
    bytes[..bytes.len().min(START_BYTES)]
        .escape_ascii()
        .to_string()
}

/// Returns true if a material may have this name: it must be usable as a file name.
pub(crate) fn is_valid_name(name: &str) -> bool {
    !name.trim().is_empty() && !name.contains(|c: char| c.is_control() || "/\\".contains(c))
}

/// Returns the message and position of a JSON error, with the quoted text shortened and escaped.
pub fn escaped_json_error(error: &serde_json::Error) -> String {
    let message = error.to_string();
    let position = format!(" at line {} column {}", error.line(), error.column());
    match message.strip_suffix(&position) {
        Some(message) => escaped(message) + &position,
        None => escaped(&message),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rejects_longer_files() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path().join("file");
        std::fs::write(&path, [7; 10]).unwrap();
        assert_eq!(read_at_most(&path, 10).unwrap(), [7; 10]);
        let error = read_at_most(&path, 9).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::InvalidData);
        let message = error.to_string();
        assert!(message.contains("10") && message.contains('9'), "{message}");
        assert!(read_at_most(scratch.path(), 9).is_err());
        // A device that never ends reports length 0.
        #[cfg(unix)]
        assert!(read_at_most(Path::new("/dev/zero"), 1000).is_err());
    }

    #[test]
    fn escaped_text_is_one_short_line() {
        assert_eq!(escaped("grün"), "grün");
        assert_eq!(escaped("a\n\u{1b}[2J"), "a\\n\\u{1b}[2J");
        assert_eq!(escaped(&"x".repeat(1 << 20)).len(), MAX_CHARACTERS + 3);
    }
}
