//! Writes the seeds of the trainer's fuzz target to trainer/fuzz/seeds/readers: small files of every format with
//! procedural materials, valid and with every named kind of damage. Seeds from the fuzzer (`*-fuzzer-*`) are not changed.
//!
//!     cargo run --release -p glimpse-tests --example seeds

mod materials;
mod others;
mod tensors;

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use glimpse_materials::Procedural;
use glimpse_trainer_fuzz::READERS;
use materials::{fitted, format, nbrdf, pab, pab_texts};
use others::{checkpoint, readings};
use tensors::{rgl, tensors};

pub(crate) type SeedResult = Result<(), Box<dyn Error>>;

fn main() -> SeedResult {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let path = root.join("trainer/fuzz/seeds/readers");
    fs::create_dir_all(&path)?;
    let seeds = |reader: &'static str| Seeds {
        path: path.clone(),
        reader,
    };
    let material = Procedural::new(3, 7);
    // The seed of core's target starts with a byte and eight numbers.
    let smallest = fs::read(root.join("core/fuzz/seeds/basis/smallest"))?;
    seeds("basis").write_lengths("smallest", &smallest[33..])?;
    nbrdf(&seeds("nbrdf"))?;
    let tensors = tensors(&material);
    rgl(&seeds("material"), &tensors)?;
    let texts = pab_texts(&material)?;
    pab(&seeds("pab"), &texts)?;
    format(&seeds("material"), &tensors.bytes(), &texts[0])?;
    readings(&seeds("readings"), &material)?;
    fitted(&seeds("material"))?;
    checkpoint(&seeds("checkpoint"))
}

/// The seeds of one reader. The first byte of a seed is the index of the reader.
pub(crate) struct Seeds {
    path: PathBuf,
    reader: &'static str,
}

impl Seeds {
    pub(crate) fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> SeedResult {
        let index = READERS.iter().position(|(name, _)| *name == self.reader);
        let index = index.ok_or("an unknown reader")? as u8;
        let path = self.path.join(format!("{}-{name}", self.reader));
        Ok(fs::write(path, [&[index][..], bytes.as_ref()].concat())?)
    }

    /// Writes a file, its first half, the file without its last byte, and the file with an additional byte.
    pub(crate) fn write_lengths(&self, name: &str, bytes: &[u8]) -> SeedResult {
        self.write(name, bytes)?;
        self.write(&format!("{name}-half"), &bytes[..bytes.len() / 2])?;
        self.write(&format!("{name}-short"), &bytes[..bytes.len() - 1])?;
        self.write(&format!("{name}-long"), [bytes, b"0"].concat())
    }
}
