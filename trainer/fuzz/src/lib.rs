//! Checks of the trainer's readers on untrusted bytes, a module for each reader.
//!
//! `fuzz_targets` runs them on libFuzzer's inputs, `tests/seeds.rs` on the files of `seeds`. This file holds
//! their shared parts: files in memory, and checks of refusals and of materials.

pub mod basis;
pub mod checkpoint;
pub mod device;
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

/// No message is longer, whatever a file holds.
const LONGEST_MESSAGE: usize = 1200;

/// A folder for one input's files, in memory where there is such a place; gone when dropped.
pub struct Folder(TempDir);

impl Folder {
    /// An empty one.
    #[must_use]
    pub fn new() -> Self {
        let memory = Path::new("/dev/shm");
        let made = match memory.is_dir() {
            true => tempfile::tempdir_in(memory),
            false => tempfile::tempdir(),
        };
        Self(made.expect("a temporary folder"))
    }

    /// Writes a file in it.
    pub fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.path().join(name);
        fs::write(&path, bytes).expect("room in the temporary folder");
        path
    }

    /// Where it is.
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

/// A refusal is one message: in one line of reasonable length, with the file's name.
pub fn refused(error: &impl Display, name: &str) {
    let message = error.to_string();
    assert!(message.contains(name), "no name: {message}");
    assert!(message.len() < LONGEST_MESSAGE, "long: {message}");
    assert!(!message.contains(char::is_control), "two lines: {message}");
}

/// Angles in radians: the pole, between, near the horizon, and below it.
pub const PLACES: [Angles<f32>; 6] = [
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

/// Looks a material up, with derivatives: its BRDF is finite and not negative.
pub fn look(material: &dyn Material) {
    for at in PLACES {
        let brdf = material.brdf(at);
        let is_brdf = |value: &f32| value.is_finite() && *value >= 0.0;
        assert!(brdf.iter().all(is_brdf), "{brdf:?} at {at:?}");
        let (again, slopes) = material.brdf_with_derivative(at);
        assert!(again.iter().all(|value| value.is_finite()), "{again:?}");
        let slopes = slopes.as_flattened();
        assert!(slopes.iter().all(|slope| !slope.is_nan()), "{slopes:?}");
    }
}

/// Replaces bytes of a large valid file: a seed holds the length that the file is cut or extended to,
/// as the difference from the valid one, then places and what stands there, 12 bytes each.
pub struct Damage {
    longer: i32,
    patches: Vec<(u32, [u8; 8])>,
}

impl Damage {
    /// Of an input.
    #[must_use]
    pub fn of(input: &[u8]) -> Option<Self> {
        let (longer, rest) = input.split_first_chunk()?;
        let (patches, _) = rest.as_chunks::<12>();
        let patches = patches.iter().map(|patch| {
            let (place, bytes) = patch.split_first_chunk().expect("there are 12");
            let mut eight = [0; 8];
            eight.copy_from_slice(bytes);
            (u32::from_le_bytes(*place), eight)
        });
        Some(Self {
            longer: i32::from_le_bytes(*longer),
            patches: patches.collect(),
        })
    }

    /// Damages a file; the length changes by 64 kB at most, but for what is cut off.
    pub fn apply(&self, bytes: &mut Vec<u8>) {
        let valid = bytes.len() as i64;
        let length = (valid + i64::from(self.longer)).clamp(0, valid + (1 << 16));
        bytes.resize(length as usize, 0);
        for (place, eight) in &self.patches {
            // Headers are small: one patch in two is there.
            let place = match place & 1 {
                0 => *place as usize / 2 % 64,
                _ => *place as usize / 2 % bytes.len().max(1),
            };
            for (byte, other) in bytes.iter_mut().skip(place).zip(eight) {
                *byte = *other;
            }
        }
    }
}
