//! The firmware's ELF file: its sizes, and copies of it with a damaged recipe.

use std::path::{Path, PathBuf};
use std::{env, fs};

use glimpse_core::recipe::Recipe;
use object::{Object, ObjectSection, ObjectSymbol};
use tempfile::NamedTempFile;

use crate::RECIPE;

/// Where `tests/run firmware` builds it.
const DEFAULT: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../embedded-demo/target/thumbv7em-none-eabihf/release/glimpse-embedded-demo"
);

/// The firmware as it was built.
#[derive(Debug)]
pub struct Firmware {
    /// Its file.
    pub path: PathBuf,
    bytes: Vec<u8>,
}

impl Firmware {
    /// Reads it from `GLIMPSE_FIRMWARE`, or from where `tests/run firmware` builds it.
    ///
    /// # Panics
    /// If it is not there, or holds another recipe than the repository.
    #[must_use]
    pub fn load() -> Self {
        Self::at(env::var_os("GLIMPSE_FIRMWARE").map_or_else(|| DEFAULT.into(), PathBuf::from))
    }

    /// Reads the firmware that moves the arms itself, in the simulated scanner.
    ///
    /// # Panics
    /// As [`Firmware::load`].
    #[must_use]
    pub fn load_arms() -> Self {
        Self::at(Path::new(DEFAULT).with_file_name("arms-simulated"))
    }

    /// Reads the same for a board.
    ///
    /// # Panics
    /// As [`Firmware::load`].
    #[must_use]
    pub fn load_arms_board() -> Self {
        Self::at(Path::new(DEFAULT).with_file_name("arms-board"))
    }

    fn at(path: PathBuf) -> Self {
        let bytes = fs::read(&path).unwrap_or_else(|error| {
            panic!(
                "{}: {error}. `tests/run firmware` builds it; with rustup's target it is \
                 `cd embedded-demo && cargo build --release`",
                path.display()
            )
        });
        let firmware = Self { path, bytes };
        firmware.recipe();
        firmware
    }

    /// The same firmware with another of the repository's recipes, by the name under which
    /// `tests/run firmware` copies it.
    ///
    /// # Panics
    /// If it is not there.
    #[must_use]
    pub fn of(name: &str) -> Self {
        let path = PathBuf::from(format!("{DEFAULT}-{name}"));
        let bytes = fs::read(&path).unwrap_or_else(|error| {
            panic!(
                "{}: {error}. `tests/run firmware` builds it",
                path.display()
            )
        });
        Self { path, bytes }
    }

    /// Its bytes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Where its recipe begins.
    fn recipe(&self) -> usize {
        assert!(
            Recipe::parse(RECIPE).is_ok(),
            "the repository's recipe is damaged"
        );
        self.bytes
            .windows(RECIPE.len())
            .position(|window| window == RECIPE)
            .expect("the firmware holds another recipe than the repository: build it again")
    }

    /// A copy whose recipe is altered.
    ///
    /// # Panics
    /// If the copy cannot be written.
    #[must_use]
    pub fn with_recipe(&self, alter: impl FnOnce(&mut [u8])) -> NamedTempFile {
        let start = self.recipe();
        let mut bytes = self.bytes.clone();
        alter(&mut bytes[start..start + RECIPE.len()]);
        let file = NamedTempFile::new().expect("room for a file");
        fs::write(file.path(), bytes).expect("room for a file");
        file
    }

    fn object(&self) -> object::File<'_> {
        object::File::parse(&*self.bytes).expect("an ELF file")
    }

    /// Size of a section in bytes; 0 if there is none.
    ///
    /// # Panics
    /// If it is no ELF file.
    #[must_use]
    pub fn section_bytes(&self, name: &str) -> u64 {
        self.object()
            .section_by_name(name)
            .map_or(0, |section| section.size())
    }

    /// Names of all functions and statics.
    ///
    /// # Panics
    /// If it is no ELF file.
    #[must_use]
    pub fn symbols(&self) -> Vec<String> {
        let object = self.object();
        let names = object.symbols().filter_map(|symbol| symbol.name().ok());
        names.map(str::to_owned).collect()
    }

    /// The same file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }
}
