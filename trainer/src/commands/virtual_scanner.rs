//! `trainer virtual-scanner`

use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::PathBuf;

use anyhow::{Context, bail};
use clap::Args;
use glimpse_materials::basis::Basis;
use glimpse_materials::{Material, Source};
use glimpse_trainer::scanner::{self, ScanReport, ScannerError, ScannerNoise};
use serde_json::{Value, json};

use super::known::tell;
use super::numbers::not_negative;
use super::output::{refuse_input, refuse_source, refuse_unwritable};
use super::{load, print, read_recipe, write_file};

/// Play motors and sensor from a material, for the firmware at the other end of the line.
///
/// For every completed scan it prints the residual that the device found at its readings, and the
/// loss of the device's result against the whole material. (Of Linear the device has coefficients
/// only: give its recipe, whose basis makes a BRDF of them.)
#[derive(Args)]
pub(crate) struct VirtualScanner {
    /// The material in front of the scanner: a source that holds one material
    #[arg(long, value_name = "FILE")]
    material: Source,
    /// Where to wait for the device's serial line
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:7878")]
    listen: SocketAddr,
    /// Standard deviation of Gaussian noise on each measured channel, relative to its value, 0 or above
    #[arg(long, value_name = "S", default_value_t = 0.0, value_parser = not_negative)]
    noise: f32,
    /// A recipe: offered to devices that can store one, and its basis judges what the model Linear finds
    #[arg(long, value_name = "FILE.recipe")]
    recipe: Option<PathBuf>,
    /// Stop after one completed scan
    #[arg(long)]
    once: bool,
    /// Write the last scan's readings, values and residual here, as JSON
    #[arg(long, value_name = "FILE.json")]
    out: Option<PathBuf>,
}

impl VirtualScanner {
    /// Serves devices, one after the other.
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        if let Some(out) = &self.out {
            refuse_source(out, &self.material)?;
            if let Some(recipe) = &self.recipe {
                refuse_input(out, recipe)?;
                refuse_input(out, &Basis::beside(recipe))?;
            }
        }
        // Before a device has measured anything.
        if let Some(out) = &self.out {
            refuse_unwritable(out)?;
        }
        let materials = load(&self.material)?;
        let [material] = &materials[..] else {
            bail!("--material takes one material, not {}", materials.len());
        };
        let material = &**material;
        let noise = ScannerNoise {
            deviation: self.noise,
            seed,
        };
        let mut scanner = scanner::VirtualScanner::new(material, noise);
        let mut basis = None;
        if let Some(path) = &self.recipe {
            let (file, found) = read_recipe(path)?;
            tell(&file.recipe(), &materials)?;
            let checksum = file.recipe().checksum();
            basis = found.map(|basis| (checksum, basis));
            scanner = scanner.offering(file.bytes().to_vec());
        }
        let listener = TcpListener::bind(self.listen)
            .with_context(|| format!("cannot listen on {}", self.listen))?;
        eprintln!("waiting for a device on {}", listener.local_addr()?);
        loop {
            let (stream, device) = listener.accept()?;
            stream.set_nodelay(true)?;
            eprintln!("a device is there: {device}");
            if self.serve(stream, &mut scanner, material, basis.as_ref())? {
                return Ok(());
            }
        }
    }

    /// Serves one device until it hangs up, or (true) the one scan that was asked for is there.
    fn serve(
        &self,
        mut stream: TcpStream,
        scanner: &mut scanner::VirtualScanner<'_>,
        material: &dyn Material,
        basis: Option<&(u32, Basis)>,
    ) -> anyhow::Result<bool> {
        loop {
            match scanner.serve(&mut stream) {
                Ok(report) => {
                    // Another recipe's basis says nothing of these coefficients.
                    let basis = basis.filter(|(recipe, _)| *recipe == report.recipe);
                    let loss = report.loss(basis.map(|(_, basis)| basis), material);
                    self.show(&report, material, loss)?;
                    if self.once {
                        return Ok(true);
                    }
                }
                Err(error @ (ScannerError::Device(_) | ScannerError::Protocol(_))) => {
                    eprintln!("{error}");
                }
                Err(error @ (ScannerError::Closed | ScannerError::Link(_))) => {
                    eprintln!("{error}");
                    return Ok(false);
                }
                Err(error @ ScannerError::Frame(_)) => return Err(error.into()),
            }
        }
    }

    fn show(
        &self,
        report: &ScanReport,
        material: &dyn Material,
        loss: Option<f64>,
    ) -> anyhow::Result<()> {
        let residual = report.residual;
        let judged = match loss {
            Some(loss) => format!("loss {loss:.5}"),
            None => "no loss (give --recipe, whose basis makes a BRDF of coefficients)".to_owned(),
        };
        print(&format!(
            "{}: {judged}; residual {:.5}, worst {:.5} at sample {}, {} saturated{}\n",
            material.name(),
            residual.mean,
            residual.worst,
            residual.worst_index,
            residual.saturated,
            residual
                .implausible
                .map_or(String::new(), |reason| format!("; implausible: {reason}")),
        ))?;
        match &self.out {
            Some(path) => {
                let json = json(report, material.name(), loss);
                write_file(path, format!("{json:#}\n").as_bytes())
            }
            None => Ok(()),
        }
    }
}

/// Angles are in radians.
fn json(report: &ScanReport, material: &str, loss: Option<f64>) -> Value {
    let readings: Vec<Value> = report
        .readings
        .iter()
        .map(|taken| {
            json!({
                "theta_h": taken.angles.theta_h,
                "theta_d": taken.angles.theta_d,
                "phi_d": taken.angles.phi_d,
                "brdf": taken.reading.brdf,
                "saturated": taken.reading.saturated,
            })
        })
        .collect();
    json!({
        "material": material,
        "model": report.model.name(),
        "recipe": format!("{:08x}", report.recipe),
        "readings": readings,
        "values": report.values,
        "residual": {
            "mean": report.residual.mean,
            "worst_index": report.residual.worst_index,
            "worst": report.residual.worst,
            "saturated": report.residual.saturated,
            "repeated": report.residual.repeated,
            "clamped": report.residual.clamped,
            "implausible": report.residual.implausible,
        },
        "loss": loss,
    })
}
