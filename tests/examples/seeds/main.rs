//! Writes the seeds of the trainer's fuzz targets to trainer/fuzz/seeds: small files of every format with procedural
//! materials, valid and with every named kind of damage. Seeds from the fuzzer (`fuzzer-*`) are not changed.
//!
//!     cargo run --release -p glimpse-tests --example seeds

mod materials;
mod others;
mod tensors;

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use glimpse_materials::Procedural;
use materials::{fitted, format, nbrdf, pab, pab_texts};
use others::{checkpoint, environment, readings};
use tensors::{rgl, tensors};

pub(crate) type SeedResult = Result<(), Box<dyn Error>>;

fn main() -> SeedResult {
    let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("../trainer/fuzz/seeds");
    let material = Procedural::new(3, 7);
    damages(&Folder::new(&seeds, "merl")?, 35_000_000)?;
    damages(&Folder::new(&seeds, "basis")?, 1_000_000)?;
    nbrdf(&Folder::new(&seeds, "nbrdf")?)?;
    let tensors = tensors(&material);
    rgl(&Folder::new(&seeds, "rgl")?, &tensors)?;
    let texts = pab_texts(&material)?;
    pab(&Folder::new(&seeds, "pab")?, &texts)?;
    format(&Folder::new(&seeds, "format")?, &tensors.bytes(), &texts[0])?;
    readings(&Folder::new(&seeds, "readings")?, &material)?;
    fitted(&Folder::new(&seeds, "material")?)?;
    checkpoint(&Folder::new(&seeds, "checkpoint")?)?;
    environment(&Folder::new(&seeds, "environment")?)
}

/// The folder with the seeds of one target.
pub(crate) struct Folder(pub(crate) PathBuf);

impl Folder {
    fn new(seeds: &Path, target: &str) -> Result<Self, Box<dyn Error>> {
        let path = seeds.join(target);
        fs::create_dir_all(&path)?;
        Ok(Self(path))
    }

    pub(crate) fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> SeedResult {
        Ok(fs::write(self.0.join(name), bytes)?)
    }

    /// Writes a file, its first half, the file without its last byte, and the file with an additional byte.
    pub(crate) fn write_lengths(&self, name: &str, bytes: &[u8]) -> SeedResult {
        self.write(name, bytes)?;
        self.write(&format!("{name}-half"), &bytes[..bytes.len() / 2])?;
        self.write(&format!("{name}-short"), &bytes[..bytes.len() - 1])?;
        self.write(&format!("{name}-long"), [bytes, b"0"].concat())
    }
}

/// Writes seeds that damage a large file, as inputs of the targets' `Damage`. `far` is half the offset of the last
/// patch.
fn damages(folder: &Folder, far: u32) -> SeedResult {
    let patch = |offset: u32, bytes: [u8; 8]| [&offset.to_le_bytes()[..], &bytes].concat();
    let damage = |length_change: i32, patches: &[Vec<u8>]| {
        [&length_change.to_le_bytes()[..], &patches.concat()].concat()
    };
    let offsets = [0, 2 * 4, 2 * 8, 2 * 20, 2 * 24, 2 * far + 1];
    folder.write("valid", damage(0, &[]))?;
    for length_change in [-1, -8, -1_000_000, i32::MIN, 1, 8] {
        let name = format!("longer-{length_change}");
        folder.write(&name, damage(length_change, &[]))?;
    }
    for (name, bytes) in [
        ("nan", f64::NAN.to_le_bytes()),
        ("infinite", f64::INFINITY.to_le_bytes()),
        ("negative", (-1.0_f64).to_le_bytes()),
        ("big-endian", 0.01_f64.to_be_bytes()),
        ("ones", [0xff; 8]),
    ] {
        for offset in offsets {
            folder.write(
                &format!("{name}-{offset}"),
                damage(0, &[patch(offset, bytes)]),
            )?;
        }
    }
    Ok(())
}
