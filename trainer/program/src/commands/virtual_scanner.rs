//! `trainer virtual-scanner`

use std::net::{SocketAddr, TcpListener};
use std::path::PathBuf;

use anyhow::{Context, ensure};
use clap::Args;
use glimpse_fitting::recipe::ReadingNoise;
use glimpse_fitting::scanner::{self, ScanReport, ScannerError};
use glimpse_materials::basis::BasisTable;
use glimpse_materials::{FittedMaterial, Material, Source};

use super::numbers::number;
use super::training_overlap::warn;
use super::{load_single, print, read_recipe};
use crate::output::{check_out, refuse_recipe, refuse_source, write_file};

/// Simulate a scanner's motors and sensor for firmware on a serial link.
///
/// Readings are taken from a material. For each completed scan, the command prints the residual that
/// the device reports, and the loss of the device's fit against the material. With the model linear,
/// the device sends only coefficients: give --recipe, whose basis turns them into a BRDF.
///
/// Without --material, the command is the host of a device that moves its own arms: it prints and
/// writes what the device has fitted.
///
/// Example: trainer virtual-scanner --material gold.binary --noise 0.01 --once --out gold-fit.json
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct VirtualScanner {
    /// Material to measure: a source with a single material [default: the device measures]
    #[arg(long, value_name = "SOURCE")]
    material: Option<Source>,
    /// TCP address that the device's serial link connects to
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:7878")]
    listen: SocketAddr,
    /// Standard deviation of Gaussian noise on each measured channel, relative to its value,
    /// 0 to 1 [default: 0]
    #[arg(long, value_name = "S", value_parser = number(0.0..=1.0_f32), requires = "material")]
    noise: Option<f32>,
    /// Recipe file of the device, whose basis the model linear needs
    #[arg(long, value_name = "FILE.recipe")]
    recipe: Option<PathBuf>,
    /// Exit after one completed scan
    #[arg(long)]
    once: bool,
    /// Material file (material.json) for the device's fit in the last scan, with its readings; for the model
    /// linear the basis is written next to it
    #[arg(long, value_name = "FILE.json")]
    out: Option<PathBuf>,
    /// Replace an existing file of --out
    #[arg(long, requires = "out")]
    force: bool,
}

impl VirtualScanner {
    /// Serves devices, one after another.
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        if let Some(out) = &self.out {
            if let Some(material) = &self.material {
                refuse_source(out, material)?;
            }
            if let Some(recipe) = &self.recipe {
                refuse_recipe(out, recipe)?;
            }
            ensure!(
                FittedMaterial::is_json_file(out),
                "--out {} does not end in .json, so that no command would read it: give NAME.json",
                out.display()
            );
            // Checked before the first scan, which would be lost otherwise.
            ensure!(
                self.force || !out.is_file(),
                "{} exists: give --force to replace it, or another output",
                out.display()
            );
            check_out(out)?;
        }
        let material = self.material.as_ref().map(load_single).transpose()?;
        let materials: Vec<_> = material.into_iter().collect();
        let material = materials.first().map(|material| &**material);
        let noise = ReadingNoise {
            multiplicative: self.noise.unwrap_or_default(),
            ..ReadingNoise::default()
        };
        let mut scanner = scanner::VirtualScanner::new(material, noise, seed);
        let mut basis = None;
        if let Some(path) = &self.recipe {
            let named = read_recipe(path)?;
            let recipe = named.file.recipe();
            warn(&named.file.metadata().materials, &materials);
            basis = named.basis.map(|basis| (recipe.checksum(), basis));
        }
        let listener = TcpListener::bind(self.listen)
            .with_context(|| format!("cannot listen on {}", self.listen))?;
        eprintln!("waiting for a device on {}", listener.local_addr()?);
        loop {
            let (mut stream, device) = listener.accept()?;
            stream.set_nodelay(true)?;
            eprintln!("device connected: {device}");
            loop {
                match scanner.serve(&mut stream) {
                    Ok(report) => {
                        // The basis of another recipe does not fit these coefficients.
                        let basis = basis.as_ref().filter(|(of, _)| *of == report.recipe);
                        self.report_scan(&report, material, basis.map(|(_, basis)| &**basis))?;
                        if self.once {
                            return Ok(());
                        }
                    }
                    Err(error) => {
                        eprintln!("{error}");
                        if matches!(error, ScannerError::Closed | ScannerError::Link(_)) {
                            break;
                        }
                    }
                }
            }
        }
    }

    /// Prints a completed scan, and writes it to the file of --out.
    fn report_scan(
        &self,
        report: &ScanReport,
        material: Option<&dyn Material>,
        basis: Option<&BasisTable>,
    ) -> anyhow::Result<()> {
        let residual = report.residual;
        let loss = material.and_then(|material| report.loss(basis, material));
        let name = material.map_or("scan", |material| material.name());
        let loss_text = match loss {
            Some(loss) => format!("loss {loss:.5}"),
            None if material.is_none() => format!("{} values", report.values.len()),
            None => {
                "loss unknown (give the device's recipe, with its basis, as --recipe)".to_owned()
            }
        };
        let percent = |name, part: Option<f32>| match part {
            Some(part) => format!(", {name} {:.1} %", 100.0 * part),
            None => format!(", {name} not checked"),
        };
        let checks = &residual.evidence;
        let dark = percent("light with the lamp off", checks.dark);
        let mut evidence = dark + &percent("drift", checks.drift);
        if checks.restored > 0 {
            let restored = checks.restored;
            evidence += &format!(", {restored} readings from before a restart of the device");
        }
        print(&format!(
            "{}: {loss_text}; residual {:.5}, worst {:.5} at sample {}, {} saturated{evidence}{}\n",
            name,
            residual.mean,
            residual.worst,
            residual.worst_index,
            residual.saturated,
            residual.implausible.map_or(String::new(), |reason| format!(
                "; implausible: {}",
                reason.text()
            )),
        ))?;
        let Some(path) = &self.out else {
            return Ok(());
        };
        let files = report.material_files(path, name, basis, loss);
        let files = files.context(
            "--out: the model linear needs a basis: give the device's recipe, with its basis, as --recipe",
        )?;
        // A later scan replaces the material. The basis must not replace that of another recipe.
        files.iter().try_for_each(|(path, bytes)| {
            write_file(path, bytes, FittedMaterial::is_json_file(path))
        })
    }
}
