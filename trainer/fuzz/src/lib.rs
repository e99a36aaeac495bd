//! Checks of the trainer's readers on untrusted bytes, one module per reader.
//!
//! `fuzz_targets` runs them on libFuzzer's inputs, and `tests/seeds.rs` on the files of `seeds`. This file has the
//! shared parts: temporary files, damage to valid files, and checks of error messages and materials.

pub mod basis;
pub mod checkpoint;
pub mod environment;
pub mod format;
pub mod material;
pub mod merl;
pub mod nbrdf;
pub mod pab;
pub mod readings;
pub mod rgl;

use std::fmt::Display;
use std::fs;
use std::path::{Path, PathBuf};

use glimpse_core::geometry::Angles;
use glimpse_materials::Material;
use tempfile::TempDir;

/// Maximum length of an error message in bytes.
const MAX_MESSAGE_LENGTH: usize = 1200;

/// A temporary folder for the files of an input, in memory if `/dev/shm` exists.
pub struct Folder(TempDir);

impl Folder {
    /// Creates an empty folder.
    #[must_use]
    pub fn new() -> Self {
        let memory = Path::new("/dev/shm");
        let folder = match memory.is_dir() {
            true => tempfile::tempdir_in(memory),
            false => tempfile::tempdir(),
        };
        Self(folder.expect("a temporary folder"))
    }

    /// Writes a file into the folder.
    pub fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.path().join(name);
        fs::write(&path, bytes).expect("room in the temporary folder");
        path
    }

    /// Returns the folder's path.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.0.path()
    }
}

impl Default for Folder {
    fn default() -> Self {
        Self::new()
    }
}

/// Checks that an error message contains the file's name and is one line of limited length.
pub fn check_rejection(error: &impl Display, name: &str) {
    let message = error.to_string();
    assert!(message.contains(name), "no file name: {message}");
    assert!(message.len() < MAX_MESSAGE_LENGTH, "too long: {message}");
    assert!(
        !message.contains(char::is_control),
        "control character: {message}"
    );
}

/// Angles in radians: at the pole, above the horizon, near the horizon, and below it.
pub const ANGLES: [Angles<f32>; 6] = [
    angles(0.0, 0.0, 0.0),
    angles(0.2, 0.3, 0.4),
    angles(0.7, 0.5, 6.2),
    angles(0.05, 1.4, 1.5),
    angles(1.5, 0.01, 3.1),
    angles(1.57, 1.5, 1.5),
];

const fn angles(theta_h: f32, theta_d: f32, phi_d: f32) -> Angles<f32> {
    Angles {
        theta_h,
        theta_d,
        phi_d,
    }
}

/// Checks that a material's BRDF is finite and not negative, and that its derivatives are not NaN.
pub fn check_material(material: &dyn Material) {
    for angles in ANGLES {
        let brdf = material.brdf(angles);
        let is_valid = |value: &f32| value.is_finite() && *value >= 0.0;
        assert!(brdf.iter().all(is_valid), "{brdf:?} at {angles:?}");
        let (brdf, derivative) = material.brdf_with_derivative(angles);
        assert!(brdf.iter().all(|value| value.is_finite()), "{brdf:?}");
        let derivative = derivative.as_flattened();
        assert!(
            derivative.iter().all(|value| !value.is_nan()),
            "{derivative:?}"
        );
    }
}

/// Changes to a large valid file.
///
/// An input contains the change of the file's length (4 bytes), then patches of 12 bytes each: a position (4 bytes) and
/// the 8 bytes to write there.
pub struct Damage {
    length_change: i32,
    patches: Vec<(u32, [u8; 8])>,
}

impl Damage {
    /// Parses an input. Returns None if it is too short.
    #[must_use]
    pub fn from_input(input: &[u8]) -> Option<Self> {
        let (length_change, rest) = input.split_first_chunk()?;
        let (patches, _) = rest.as_chunks::<12>();
        let patches = patches.iter().map(|patch| {
            let (position, bytes) = patch.split_first_chunk().expect("a patch has 12 bytes");
            let mut replacement = [0; 8];
            replacement.copy_from_slice(bytes);
            (u32::from_le_bytes(*position), replacement)
        });
        Some(Self {
            length_change: i32::from_le_bytes(*length_change),
            patches: patches.collect(),
        })
    }

    /// Applies the changes. A file grows by 64 kB at most.
    pub fn apply(&self, bytes: &mut Vec<u8>) {
        let valid_length = bytes.len() as i64;
        let length = valid_length + i64::from(self.length_change);
        let length = length.clamp(0, valid_length + (1 << 16));
        bytes.resize(length as usize, 0);
        for (position, replacement) in &self.patches {
            // A patch with an even position is in the first 64 bytes, which include the header.
            let position = match position & 1 {
                0 => *position as usize / 2 % 64,
                _ => *position as usize / 2 % bytes.len().max(1),
            };
            for (byte, new_byte) in bytes.iter_mut().skip(position).zip(replacement) {
                *byte = *new_byte;
            }
        }
    }
}
