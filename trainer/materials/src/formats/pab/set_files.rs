//! The files of a set, found by their names and headers.

use std::io;
use std::path::{Path, PathBuf};

use super::ANGLE_TOLERANCE;
use super::file::{has_signature, incoming_angles, sample_name};
use crate::SourceError;
use crate::error::{Defect, entries, read_error};
use crate::files::directory_of;
use crate::untrusted::{self, escaped, is_valid_name};

/// The number of bytes that are read from each file in the directory, to get its header.
const HEAD_BYTES: u64 = 1 << 14;

/// Returns the name of a file's sample, or else that of the file.
pub(super) fn sample_name_of(path: &Path) -> Result<String, SourceError> {
    match sample_name(&read_head(path).map_err(read_error(path))?) {
        None => Ok(path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()),
        Some(name) if is_valid_name(name) => Ok(name.to_owned()),
        Some(name) => Err(Defect::in_file(path)(format!(
            "its sample_name is {}, and must be a name without slashes",
            escaped(name)
        ))),
    }
}

/// Returns the files of the set of `path`, sorted. `path` is one of them.
pub(crate) fn files_of(path: &Path) -> Result<Vec<PathBuf>, SourceError> {
    let names = set_names(path, &read_head(path).map_err(read_error(path))?);
    let mut files = Vec::new();
    for entry in entries(directory_of(path))? {
        let candidate = path.with_file_name(entry.file_name().unwrap_or_default());
        let is_in_set = candidate == path
            || candidate.is_file()
                && read_head(&candidate).is_ok_and(|head| {
                    let others = set_names(&candidate, &head);
                    let mut pairs = names.iter().zip(others);
                    has_signature(head.as_bytes())
                        && pairs.any(|(name, other)| name.is_some() && *name == other)
                });
        if is_in_set {
            files.push(candidate);
        }
    }
    files.sort();
    Ok(files)
}

/// Returns the names that a file shares with other files of its set: that of the sample, also without the incoming angles;
/// that of the file without them; and, if the sample has no name, that of the file without digits at the end.
fn set_names(path: &Path, head: &str) -> [Option<String>; 4] {
    let sample = sample_name(head);
    let angles = incoming_angles(head);
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let numbered = stem.trim_end_matches(|c: char| c.is_ascii_digit());
    [
        sample.map(str::to_owned),
        sample.and_then(|name| without_angles(name, &angles)),
        without_angles(&file, &angles),
        sample.is_none().then(|| numbered.to_owned()),
    ]
}

/// Returns a name with `#` in place of each number that is one of `angles`; None without such a number.
fn without_angles(name: &str, angles: &[f64]) -> Option<String> {
    let is_in_number = |c: char| c.is_ascii_digit() || c == '.';
    let mut result = String::new();
    let mut rest = name;
    while let Some(start) = rest.find(|c: char| c.is_ascii_digit()) {
        let length = rest[start..].find(|c| !is_in_number(c));
        let number = &rest[start..][..length.unwrap_or(rest.len() - start)];
        // The last period precedes an extension.
        let number = number.trim_end_matches('.');
        let is_angle = |value: f64| {
            let mut differences = angles.iter().map(|angle| (angle - value).abs());
            differences.any(|difference| difference < ANGLE_TOLERANCE)
        };
        result += &rest[..start];
        result += match number.parse().is_ok_and(is_angle) {
            true => "#",
            false => number,
        };
        rest = &rest[start + number.len()..];
    }
    result.contains('#').then_some(result + rest)
}

/// Reads the first bytes of a file, which may have any format and length.
fn read_head(path: &Path) -> io::Result<String> {
    let head = untrusted::read_head(path, HEAD_BYTES)?;
    Ok(String::from_utf8_lossy(&head).into_owned())
}
