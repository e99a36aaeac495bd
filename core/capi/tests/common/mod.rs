//! Expected output of the C examples, and their compilation.

use std::path::{Path, PathBuf};
use std::process::Command;

use glimpse_core::fit::AnyModel;
use glimpse_core::geometry::Directions;
use glimpse_core::gonio::{Calibration, Footprint, Limits, Machine, Reading, Repeated};
use glimpse_core::recipe::Recipe;
use glimpse_core::scan::Scan;

/// Names and files of the recipes, in the order of the examples.
const RECIPES: [(&str, &str); 5] = [
    ("phong", "paper/phong-n8.recipe"),
    ("cook-torrance", "paper/cook-torrance-n8.recipe"),
    ("neural", "paper/neural-n8.recipe"),
    ("linear", "paper/linear-n8.recipe"),
    ("neural-completed", "completed/neural-n8.recipe"),
];

/// Returns the folder of this crate.
pub fn folder() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Returns a reading of the simulated material in examples/example.h.
fn read_sensor(at: &Directions<f32>) -> Reading {
    let ([a, b, c], [d, e, f]) = (at.incoming, at.outgoing);
    let (x, y, z) = (a + d, b + e, c + f);
    let across = x * x + y * y;
    let squared = across + z * z;
    let from_normal = across / squared;
    let lobe = |sharpness: f32| {
        let falloff = 1.0 + sharpness * from_normal;
        1.0 / (falloff * falloff)
    };
    let lobes = (8.0 * lobe(40.0) + lobe(0.1 * 40.0)) / 9.0;
    let grazing = 1.0 + 0.2 * (1.0 - 0.25 * squared);
    let highlight = 0.9 * lobes * grazing;
    let light = 9000.0 * at.incoming[2];
    let brdf = [0.12 + highlight, 0.05 + highlight, 0.03 + 0.9 * highlight];
    let mut repeated = Repeated::default();
    for time in [0.0, 1.0] {
        let counts = brdf.map(|brdf| 100.0 + time + light * brdf);
        repeated.add(counts, false).unwrap();
    }
    let reference = Directions {
        incoming: [0.0, 0.0, 1.0],
        outgoing: [0.6, 0.0, 0.8],
    };
    let calibration = Calibration::monochrome(100.0, 3000.0, 0.99).unwrap();
    let calibration = calibration.read_once_at(&reference, Footprint::LightLarger);
    let counts = repeated.mean().unwrap();
    calibration.unwrap().reading(counts, at).unwrap()
}

/// Returns the folder of the bundled recipes.
fn recipes() -> PathBuf {
    folder().join("../../trainer/recipes")
}

fn line(name: &str, quantity: &str, values: &[f32]) -> String {
    let bits = values
        .iter()
        .map(|value| format!("{:08x} ", value.to_bits()));
    format!("{name}.{quantity}={}\n", bits.collect::<String>())
}

/// Returns the expected output of `scan.c` and `driver.c`: the bits of the same scans with core.
pub fn expected() -> [String; 2] {
    let mut printed = [String::new(), String::new()];
    for (name, file) in RECIPES {
        let recipe = std::fs::read(recipes().join(file)).unwrap();
        let recipe = Recipe::parse(&recipe).unwrap();
        let mut memory = vec![0.0; recipe.memory_words()];
        let mut scan = Scan::<AnyModel>::new(recipe, &mut memory).unwrap();
        let mut machine = Machine::new(Limits::NONE);
        machine.limits.min_separation = 0.01;
        machine.through_normal = true;
        let (mut arms, mut seconds) = (machine.fixed, 0.0);
        while let Some(next) = machine.nearest(scan.pending(), &arms) {
            let (_, at) = recipe.directions().nth(next.index.into()).unwrap();
            scan.record(next.index, read_sensor(&at)).unwrap();
            (arms, seconds) = (next.arms, seconds + next.seconds);
        }
        let mut fit = scan.fit().unwrap();
        while !fit.advance(u32::MAX).is_complete() {}
        let fitted = fit.finish().unwrap();
        let mirror = Directions {
            incoming: [0.6, 0.0, 0.8],
            outgoing: [-0.6, 0.0, 0.8],
        };
        let residual = fitted.residual();
        let predicted = fitted.predicted_loss().unwrap_or(f32::NAN);
        let mut lines = line(name, "mean", &[residual.mean]);
        lines += &line(name, "worst", &[residual.worst]);
        lines += &line(name, "predicted", &[predicted]);
        if let Some(brdf) = fitted.brdf(&mirror) {
            lines += &line(name, "brdf", &brdf);
        }
        let [by_steps, by_driver] = &mut printed;
        *by_steps += &line(name, "seconds", &[seconds]);
        *by_steps += &lines;
        *by_steps += &line(name, "values", &fitted.values().collect::<Vec<_>>());
        // In addition to the samples, with the lamp off before each part of the scan and at the end, and the first again.
        *by_driver += &line(name, "moves", &[12.0]);
        *by_driver += &lines;
    }
    printed
}

/// Compiles an example. `options` name the machine and the library.
pub fn compile(compiler: &str, platform: &str, example: &str, options: &[&str], out: &Path) {
    let examples = folder().join("examples");
    let sources: Vec<PathBuf> = [example, platform, "recipes.S"]
        .map(|file| examples.join(file))
        .into();
    let output = Command::new(compiler)
        .args(["-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror"])
        // ISO C's default. Explicit, because fused products round differently.
        .arg("-ffp-contract=off")
        .arg("-I")
        .arg(folder().join("include"))
        .arg(format!("-Wa,-I{}", recipes().display()))
        .args(sources)
        .args(options)
        .arg("-o")
        .arg(out)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{compiler} {options:?}:\n{text}");
}

/// Runs a program and returns its output.
pub fn run(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success(),
        "{command:?}: {}\n{text}{errors}",
        output.status
    );
    text
}
