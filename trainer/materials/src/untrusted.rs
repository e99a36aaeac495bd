//! Files of other people: read no further than makes sense, and quoted in messages without harm.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// How many characters of a file's text a message shows.
const SHOWN: usize = 120;

/// Reads a whole file, a pipe or a device, unless it has more than `most` bytes. Such a file cannot be
/// the one that is meant, and memory is not filled with it.
///
/// # Errors
/// If the operating system refuses, or it has more.
pub fn read_at_most(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let file = open_at_most(path, most)?;
    let mut bytes = Vec::new();
    file.take(most + 1).read_to_end(&mut bytes)?;
    match bytes.len() as u64 > most {
        true => Err(too_long(&format!("more than {most}"), most)),
        false => Ok(bytes),
    }
}

/// Opens a file, unless its length is known and above `most` bytes.
///
/// # Errors
/// If the operating system refuses, or the file is longer.
pub fn open_at_most(path: &Path, most: u64) -> io::Result<File> {
    let file = File::open(path)?;
    let metadata = file.metadata()?;
    if metadata.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    if metadata.len() > most {
        return Err(too_long(&format!("{}", metadata.len()), most));
    }
    Ok(file)
}

fn too_long(bytes: &str, most: u64) -> io::Error {
    let what = format!(
        "it has {bytes} bytes, and such a file has {most} at most; give the file that is meant"
    );
    io::Error::new(io::ErrorKind::InvalidData, what)
}

/// A file's text as a message shows it: its beginning, in one line, without what a terminal would
/// take for an order.
pub fn escaped(text: &str) -> String {
    escaped_up_to(SHOWN, text)
}

/// The same, up to so many characters.
pub fn escaped_up_to(most: usize, text: &str) -> String {
    let mut shown: String = text
        .chars()
        .take(most)
        .flat_map(|c| match c.is_control() {
            true => c.escape_default().collect::<Vec<char>>(),
            false => vec![c],
        })
        .collect();
    if text.chars().nth(most).is_some() {
        shown += "...";
    }
    shown
}

/// The same of what is wrong with JSON, which may quote any length of it, and where that is.
pub fn escaped_json_error(error: &serde_json::Error) -> String {
    let whole = error.to_string();
    let place = format!(" at line {} column {}", error.line(), error.column());
    match whole.strip_suffix(&place) {
        Some(what) => escaped(what) + &place,
        None => escaped(&whole),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_is_read_than_is_allowed() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path().join("file");
        std::fs::write(&path, [7; 10]).unwrap();
        assert_eq!(read_at_most(&path, 10).unwrap(), [7; 10]);
        let error = read_at_most(&path, 9).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::InvalidData);
        let message = error.to_string();
        assert!(message.contains("10") && message.contains('9'), "{message}");
        assert!(read_at_most(scratch.path(), 9).is_err());
        // A device without an end says that it has no bytes.
        #[cfg(unix)]
        assert!(read_at_most(Path::new("/dev/zero"), 1000).is_err());
    }

    #[test]
    fn a_message_is_one_short_line() {
        assert_eq!(escaped("grün"), "grün");
        assert_eq!(escaped("a\n\u{1b}[2J"), "a\\n\\u{1b}[2J");
        assert_eq!(escaped(&"x".repeat(1 << 20)).len(), SHOWN + 3);
    }
}
