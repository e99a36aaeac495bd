//! The firmware's ELF file: sizes of its sections, and copies with another recipe.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::{env, fs};

use crc::{CRC_32_ISO_HDLC, Crc};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::HEADER_BYTES;
use glimpse_trainer::bundled;
use object::{Object, ObjectSection, ObjectSymbol};
use tempfile::NamedTempFile;

use crate::RECIPE;

/// Path of the firmware built by `tests/run firmware`.
const DEFAULT_PATH: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../embedded-demo/target/thumbv7em-none-eabihf/release/glimpse-embedded-demo"
);

/// The kind of the section that pads a recipe. It is optional and unknown, so readers skip it.
const PADDING: u16 = 0x3FFF;

/// Returns a recipe of exactly `length` bytes: the same sections, followed by a section of zeros.
///
/// # Panics
/// If the recipe is longer, or too long for the smallest section.
#[must_use]
pub fn pad_recipe(recipe: &[u8], length: usize) -> Vec<u8> {
    if recipe.len() == length {
        return recipe.to_vec();
    }
    // A section consists of its kind and its length, both varints, and its bytes. The kind takes two bytes.
    let room = length.checked_sub(recipe.len() + 2);
    let room = room.expect("the recipe has room for a section of padding");
    let sizes = (1..=3).map(|bytes| room.saturating_sub(bytes));
    let section = sizes
        .map(|size| postcard::to_allocvec(&(PADDING, vec![0_u8; size])).expect("a section"))
        .find(|section| section.len() == room + 2);
    // One length in 2^7 cannot be reached with a varint of the shortest form.
    let section = section.expect("a section of zeros has the missing length");
    let mut bytes = [recipe, &section].concat();
    let body = (length - HEADER_BYTES) as u32;
    bytes[6..10].copy_from_slice(&body.to_le_bytes());
    let covered = [&bytes[4..10], &bytes[HEADER_BYTES..]].concat();
    let checksum = Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(&covered);
    bytes[10..HEADER_BYTES].copy_from_slice(&checksum.to_le_bytes());
    bytes
}

/// The built firmware.
#[derive(Debug)]
pub struct Firmware {
    /// Path of the file.
    pub path: PathBuf,
    bytes: Vec<u8>,
    /// Range of the recipe in `bytes`.
    recipe: Range<usize>,
}

impl Firmware {
    /// Reads the firmware from the path in `GLIMPSE_FIRMWARE`, or from the path at which `tests/run firmware` builds
    /// it.
    ///
    /// # Panics
    /// If the file does not exist, or holds another recipe than the repository.
    #[must_use]
    pub fn load() -> Self {
        let path = env::var_os("GLIMPSE_FIRMWARE");
        Self::read(
            path.map_or_else(|| DEFAULT_PATH.into(), PathBuf::from),
            RECIPE,
        )
    }

    /// Reads the firmware of a model. Its image holds the model's largest bundled recipe.
    ///
    /// # Panics
    /// As [`Firmware::load`].
    #[must_use]
    pub fn for_model(model: ModelKind) -> Self {
        let name = format!("{}-n32", model.name());
        let bundled = bundled::find(&name).unwrap_or_else(|| panic!("no bundled recipe {name}"));
        let path = format!("{DEFAULT_PATH}-{}", model.name());
        Self::read(path.into(), bundled.bytes)
    }

    fn read(path: PathBuf, recipe: &'static [u8]) -> Self {
        let bytes = fs::read(&path).unwrap_or_else(|error| {
            panic!(
                "{}: {error}. Build it with `tests/run firmware`, or, with rustup's target, with \
                 `cd embedded-demo && cargo build --release`",
                path.display()
            )
        });
        let start = bytes
            .windows(recipe.len())
            .position(|window| window == recipe)
            .expect("the firmware holds another recipe than the repository: build it again");
        Self {
            path,
            bytes,
            recipe: start..start + recipe.len(),
        }
    }

    /// The file's bytes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Writes a copy with an altered recipe.
    ///
    /// # Panics
    /// If the copy cannot be written.
    #[must_use]
    pub fn with_altered_recipe(&self, alter: impl FnOnce(&mut [u8])) -> NamedTempFile {
        let mut bytes = self.bytes.clone();
        alter(&mut bytes[self.recipe.clone()]);
        let file = NamedTempFile::new().expect("a temporary file");
        fs::write(file.path(), bytes).expect("a temporary file");
        file
    }

    /// Writes a copy that holds another recipe, padded to the length of the original.
    ///
    /// # Panics
    /// If the recipe is too long, or the copy cannot be written.
    #[must_use]
    pub fn with_recipe(&self, recipe: &[u8]) -> NamedTempFile {
        let recipe = pad_recipe(recipe, self.recipe.len());
        self.with_altered_recipe(|bytes| bytes.copy_from_slice(&recipe))
    }

    fn object(&self) -> object::File<'_> {
        object::File::parse(&*self.bytes).expect("an ELF file")
    }

    /// Returns the size of a section in bytes, or 0 if there is none.
    ///
    /// # Panics
    /// If the file is not an ELF file.
    #[must_use]
    pub fn section_bytes(&self, name: &str) -> u64 {
        self.object()
            .section_by_name(name)
            .map_or(0, |section| section.size())
    }

    /// Returns the names of all functions and statics.
    ///
    /// # Panics
    /// If the file is not an ELF file.
    #[must_use]
    pub fn symbols(&self) -> Vec<String> {
        let object = self.object();
        let names = object.symbols().filter_map(|symbol| symbol.name().ok());
        names.map(str::to_owned).collect()
    }

    /// The path of the file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }
}
