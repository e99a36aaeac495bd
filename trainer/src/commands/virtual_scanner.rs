//! `trainer virtual-scanner`

use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::PathBuf;

use anyhow::{Context, bail, ensure};
use clap::Args;
use glimpse_trainer::material::{Material, Source};
use glimpse_trainer::scanner::{self, Options, ScanReport, ScannerError};
use serde_json::{Value, json};

use super::{load, print, write_file};

/// Play motors and sensor from a material, for the firmware at the other end of the line.
///
/// For every completed scan it prints the residual that the device found at its measurements,
/// and the loss of the device's parameters against the whole material.
#[derive(Args)]
pub(crate) struct VirtualScanner {
    /// The material in front of the scanner: a source that holds one material
    #[arg(long, value_name = "FILE")]
    material: Source,
    /// Where to wait for the device's serial line
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:7878")]
    listen: SocketAddr,
    /// Standard deviation of Gaussian noise on each measured channel, relative to its value
    #[arg(long, value_name = "S", default_value_t = 0.0)]
    noise: f32,
    /// Stop after one completed scan
    #[arg(long)]
    once: bool,
    /// Write the last scan's measurements, parameters and residual here, as JSON
    #[arg(long, value_name = "FILE.json")]
    out: Option<PathBuf>,
}

impl VirtualScanner {
    /// Serves devices, one after the other.
    pub(crate) fn run(&self, seed: u64) -> anyhow::Result<()> {
        ensure!(
            self.noise.is_finite() && self.noise >= 0.0,
            "--noise takes a number that is not negative"
        );
        let materials = load(&self.material)?;
        let [material] = &materials[..] else {
            bail!("--material takes one material, not {}", materials.len());
        };
        let material = &**material;
        let options = Options {
            noise: self.noise,
            seed,
        };
        let mut scanner = scanner::VirtualScanner::new(material, options);
        let listener = TcpListener::bind(self.listen)
            .with_context(|| format!("cannot listen on {}", self.listen))?;
        eprintln!("waiting for a device on {}", listener.local_addr()?);
        loop {
            let (stream, device) = listener.accept()?;
            stream.set_nodelay(true)?;
            eprintln!("a device is there: {device}");
            if self.serve(stream, &mut scanner, material, seed)? {
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
        seed: u64,
    ) -> anyhow::Result<bool> {
        loop {
            match scanner.serve(&mut stream) {
                Ok(report) => {
                    self.show(&report, material, report.loss(material, seed))?;
                    if self.once {
                        return Ok(true);
                    }
                }
                Err(
                    error @ (ScannerError::Device(_)
                    | ScannerError::Protocol(_)
                    | ScannerError::Model(_)),
                ) => {
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

    fn show(&self, report: &ScanReport, material: &dyn Material, loss: f64) -> anyhow::Result<()> {
        let residual = report.residual;
        print(&format!(
            "{}: loss {loss:.5}; residual {:.5}, worst {:.5} at sample {}, {} saturated{}\n",
            material.name(),
            residual.mean,
            residual.worst,
            residual.worst_index,
            residual.saturated,
            match usize::from(residual.repeated) + 1 == report.measurements.len() {
                true => ", all the same: the sensor may be stuck",
                false => "",
            },
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
fn json(report: &ScanReport, material: &str, loss: f64) -> Value {
    let measurements: Vec<Value> = report
        .measurements
        .iter()
        .map(|taken| {
            json!({
                "theta_h": taken.angles.theta_h,
                "theta_d": taken.angles.theta_d,
                "phi_d": taken.angles.phi_d,
                "brdf": taken.measurement.brdf,
                "saturated": taken.measurement.saturated,
            })
        })
        .collect();
    json!({
        "material": material,
        "model": report.model.name(),
        "recipe": format!("{:08x}", report.recipe),
        "measurements": measurements,
        "parameters": report.parameters,
        "residual": {
            "mean": report.residual.mean,
            "worst_index": report.residual.worst_index,
            "worst": report.residual.worst,
            "saturated": report.residual.saturated,
            "repeated": report.residual.repeated,
        },
        "loss": loss,
    })
}
