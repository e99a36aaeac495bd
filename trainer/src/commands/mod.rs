//! The subcommands, one file each; results go to stdout or --out, talk goes to stderr.

pub(crate) mod bench;
pub(crate) mod evaluate;
pub(crate) mod export;
pub(crate) mod inspect;
pub(crate) mod progress;
pub(crate) mod quickstart;
pub(crate) mod train;
pub(crate) mod virtual_scanner;

use std::io::{self, Write};
use std::path::Path;

use anyhow::Context;
use glimpse_core::model::ModelKind;
use glimpse_trainer::files::write_whole;
use glimpse_trainer::material::{Material, Source};

/// The models, as named on the command line.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub(crate) enum ModelName {
    /// 7 parameters: diffuse and specular colour, glossiness.
    Phong,
    /// 8 parameters: diffuse and specular colour, roughness, reflectance.
    CookTorrance,
    /// 675 parameters: a small network.
    Neural,
}

impl From<ModelName> for ModelKind {
    fn from(name: ModelName) -> Self {
        match name {
            ModelName::Phong => Self::Phong,
            ModelName::CookTorrance => Self::CookTorrance,
            ModelName::Neural => Self::Neural,
        }
    }
}

/// Loads materials and says so.
pub(crate) fn load(source: &Source) -> anyhow::Result<Vec<Box<dyn Material>>> {
    let materials = source.load()?;
    match &materials[..] {
        [one] => eprintln!("1 material from {source}: {}", one.name()),
        more => eprintln!("{} materials from {source}", more.len()),
    }
    Ok(materials)
}

/// Writes a file whole or not at all.
pub(crate) fn write_file(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    write_whole(path, bytes).with_context(|| format!("cannot write {}", path.display()))?;
    eprintln!("wrote {}", path.display());
    Ok(())
}

/// Prints to stdout; a reader that has gone away, as `head` does, is no error.
pub(crate) fn print(text: &str) -> anyhow::Result<()> {
    match io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(error).context("cannot write to standard output")
        }
        _ => Ok(()),
    }
}
