//! Temporary files, checks of error messages, and angles.

use std::fmt::Display;
use std::fs;
use std::path::{Path, PathBuf};

use glimpse_core::geometry::Angles;
use tempfile::TempDir;

/// A temporary folder for the files of an input, in memory if `/dev/shm` exists.
pub(crate) struct Folder(TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        let folder = tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir());
        Self(folder.expect("a temporary folder"))
    }

    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.path().join(name);
        fs::write(&path, bytes).expect("room in the temporary folder");
        path
    }

    pub(crate) fn path(&self) -> &Path {
        self.0.path()
    }
}

/// Returns the result of a reader, or None if it rejects its file. The error message must contain the file's name, and be
/// one line of at most 1200 bytes.
pub(crate) fn accepted<T>(result: Result<T, impl Display>, name: &str) -> Option<T> {
    let message = match result {
        Ok(result) => return Some(result),
        Err(error) => error.to_string(),
    };
    assert!(message.contains(name), "no file name: {message}");
    assert!(message.len() <= 1200, "too long: {message}");
    let has_control = message.contains(char::is_control);
    assert!(!has_control, "control character: {message}");
    None
}

/// Angles in radians: at the pole, above the horizon, near the horizon, and below it.
pub(crate) const ANGLES: [Angles<f32>; 6] = [
    angles(0.0, 0.0, 0.0),
    angles(0.2, 0.3, 0.4),
    angles(0.7, 0.5, 6.2),
    angles(0.05, 1.4, 1.5),
    angles(1.5, 0.01, 3.1),
    angles(1.57, 1.5, 1.5),
];

const fn angles(theta_h: f32, theta_d: f32, phi_d: f32) -> Angles<f32> {
    Angles::from_array([theta_h, theta_d, phi_d])
}
