//! Writes the seeds of the trainer's fuzz targets, trainer/fuzz/seeds: small files of every format, valid
//! and damaged in every way that has a name, made of procedural materials. Those that fuzzing has found
//! (`found-*`) stay as they are.
//!
//!     cargo run --release -p glimpse-tests --example seeds

mod materials;
mod others;
mod tensors;

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use glimpse_materials::Procedural;
use materials::{fitted, format, nbrdf, pab, texts};
use others::{checkpoint, device, environment, readings};
use tensors::{rgl, tensors};

pub(crate) type Outcome = Result<(), Box<dyn Error>>;

fn main() -> Outcome {
    let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("../trainer/fuzz/seeds");
    let material = Procedural::new(3, 7);
    damages(&Folder::new(&seeds, "merl")?, 35_000_000)?;
    damages(&Folder::new(&seeds, "basis")?, 1_000_000)?;
    nbrdf(&Folder::new(&seeds, "nbrdf")?)?;
    let tensors = tensors(&material);
    rgl(&Folder::new(&seeds, "rgl")?, &tensors)?;
    let texts = texts(&material)?;
    pab(&Folder::new(&seeds, "pab")?, &texts)?;
    format(&Folder::new(&seeds, "format")?, &tensors.bytes(), &texts[0])?;
    readings(&Folder::new(&seeds, "readings")?, &material)?;
    device(&Folder::new(&seeds, "device")?)?;
    fitted(&Folder::new(&seeds, "material")?)?;
    checkpoint(&Folder::new(&seeds, "checkpoint")?)?;
    environment(&Folder::new(&seeds, "environment")?)
}

/// The seeds of one target.
pub(crate) struct Folder(pub(crate) PathBuf);

impl Folder {
    fn new(seeds: &Path, target: &str) -> Result<Self, Box<dyn Error>> {
        let path = seeds.join(target);
        fs::create_dir_all(&path)?;
        Ok(Self(path))
    }

    pub(crate) fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> Outcome {
        Ok(fs::write(self.0.join(name), bytes)?)
    }

    /// A valid file, and the same cut in the middle and at its last byte, and with a byte too many.
    pub(crate) fn write_lengths(&self, name: &str, bytes: &[u8]) -> Outcome {
        self.write(name, bytes)?;
        self.write(&format!("{name}-half"), &bytes[..bytes.len() / 2])?;
        self.write(&format!("{name}-short"), &bytes[..bytes.len() - 1])?;
        self.write(&format!("{name}-long"), [bytes, b"0"].concat())
    }
}

/// Of a large file: how it is damaged; see `Damage` of the targets.
fn damages(folder: &Folder, far: u32) -> Outcome {
    let patch = |place: u32, bytes: [u8; 8]| [&place.to_le_bytes()[..], &bytes].concat();
    let damaged =
        |longer: i32, patches: &[Vec<u8>]| [&longer.to_le_bytes()[..], &patches.concat()].concat();
    let places = [0, 2 * 4, 2 * 8, 2 * 20, 2 * 24, 2 * far + 1];
    folder.write("valid", damaged(0, &[]))?;
    for longer in [-1, -8, -1_000_000, i32::MIN, 1, 8] {
        folder.write(&format!("longer-{longer}"), damaged(longer, &[]))?;
    }
    for (name, bytes) in [
        ("nan", f64::NAN.to_le_bytes()),
        ("infinite", f64::INFINITY.to_le_bytes()),
        ("negative", (-1.0_f64).to_le_bytes()),
        ("big-endian", 0.01_f64.to_be_bytes()),
        ("ones", [0xff; 8]),
    ] {
        for place in places {
            folder.write(
                &format!("{name}-{place}"),
                damaged(0, &[patch(place, bytes)]),
            )?;
        }
    }
    Ok(())
}
