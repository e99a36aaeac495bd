//! `trainer virtual-scanner`: plays a scanner in front of a material, for the firmware.

use std::error::Error;
use std::fs;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};

use clap::Args;
use glimpse_trainer::material::{Material, Source};
use glimpse_trainer::scanner::{
    LOSS_DIRECTIONS, Options, ScanReport, ScannerError, VirtualScanner,
};
use serde_json::{Value, json};

/// Play motors and sensor from a material, over the firmware's link.
///
/// For every completed scan it prints the residual that the device found at its measurements,
/// and the loss of the device's parameters against the whole material.
#[derive(Debug, Args)]
pub(crate) struct VirtualScannerArgs {
    /// The material in front of the scanner: a file, or a source that holds one material.
    #[arg(long, value_name = "FILE")]
    material: String,
    /// Where to wait for the device's serial line.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:7878")]
    listen: SocketAddr,
    /// Standard deviation of Gaussian noise on each measured channel, relative to its value.
    #[arg(long, value_name = "S", default_value_t = 0.0)]
    noise: f32,
    /// Seed of the noise.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Stop after one completed scan.
    #[arg(long)]
    once: bool,
    /// Write the last scan's measurements, parameters and residual here, as JSON.
    #[arg(long, value_name = "FILE.json")]
    out: Option<PathBuf>,
}

/// Serves devices, one after the other.
///
/// # Errors
/// If the material cannot be read, the address cannot be had, or a result cannot be written.
pub(crate) fn run(args: &VirtualScannerArgs) -> Result<(), Box<dyn Error>> {
    if !(args.noise.is_finite() && args.noise >= 0.0) {
        return Err("--noise takes a number that is not negative".into());
    }
    let materials = Source(args.material.clone()).load()?;
    let [material] = &materials[..] else {
        let count = materials.len();
        return Err(format!(
            "--material takes one material; {} has {count}",
            args.material
        )
        .into());
    };
    let options = Options {
        noise: args.noise,
        seed: args.seed,
    };
    let mut scanner = VirtualScanner::new(&**material, options);

    let listener = TcpListener::bind(args.listen)
        .map_err(|error| format!("cannot listen on {}: {error}", args.listen))?;
    eprintln!(
        "{} lies in the scanner; waiting for a device on {}",
        material.name(),
        listener.local_addr()?
    );
    loop {
        let (mut stream, device) = listener.accept()?;
        stream.set_nodelay(true)?;
        eprintln!("a device is there: {device}");
        if serve(args, &mut scanner, &mut stream, &**material)? {
            return Ok(());
        }
    }
}

/// Serves one device until it hangs up, or (true) the one scan that was asked for is there.
fn serve(
    args: &VirtualScannerArgs,
    scanner: &mut VirtualScanner<'_>,
    stream: &mut TcpStream,
    material: &dyn Material,
) -> Result<bool, Box<dyn Error>> {
    loop {
        match scanner.serve(stream) {
            Ok(report) => {
                let loss = report.loss(material);
                println!(
                    "{}: residual {:.5} (worst {:.5} at sample {}, {} saturated), \
                     loss {loss:.5} over {LOSS_DIRECTIONS} directions",
                    material.name(),
                    report.residual.mean,
                    report.residual.worst,
                    report.residual.worst_index,
                    report.residual.saturated,
                );
                if let Some(path) = &args.out {
                    write(path, &json(&report, material.name(), loss))?;
                }
                if args.once {
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

fn write(path: &Path, value: &Value) -> Result<(), Box<dyn Error>> {
    fs::write(path, format!("{value:#}\n"))
        .map_err(|error| format!("cannot write {}: {error}", path.display()).into())
}

/// Angles are in radians.
fn json(report: &ScanReport, material: &str, loss: f32) -> Value {
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
        },
        "loss": loss,
    })
}
