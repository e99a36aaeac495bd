//! Counts what others take for a fit, beside Glimpse, on the same emulated Cortex-M4F, from the same
//! recipe and measurements: of Neural plain C by `arm-none-eabi-gcc -O3`, which ends in the same
//! parameters; of Phong multicalc's Levenberg-Marquardt, which ends in others, so that both are judged
//! where nothing was measured.
//!
//! It needs what `tests/run firmware` has installed and built, and the Debian packages
//! gcc-arm-none-eabi and libnewlib-arm-none-eabi.

use std::error::Error;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::Command;

use glimpse_bench::judge::loss;
use glimpse_bench::{Material, measure, recipes};
use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::Phong;
use glimpse_core::recipe::{FitMethod, Recipe};
use glimpse_tests::cycles::of_fit;
use glimpse_tests::figures::BRDF_READINGS;
use glimpse_tests::microcontroller::{Binary, Functions, TARGETS};

fn main() -> Result<(), Box<dyn Error>> {
    neural()?;
    phong();
    Ok(())
}

/// Phong, against multicalc.
fn phong() {
    let [ours, rival] = ["phong", "rival-phong"].map(|name| {
        let binary = Binary::new(TARGETS[0], Functions::Libm, name);
        let output = binary.run();
        let loss = loss::<Phong>(&output.numbers("parameters"), &Material::COUNTED);
        let later = output
            .found("brdf_instructions")
            .map_or(0, |_| BRDF_READINGS);
        (of_fit(&binary, later), output.count("stack_bytes"), loss)
    });
    for (name, (count, stack, loss)) in [("glimpse", ours), ("multicalc", rival)] {
        println!(
            "Phong by {name}: {} instructions, {} cycles, {stack} bytes of stack, loss {loss:.4}; \
             {:.2} times the cycles",
            count.instructions,
            count.cycles,
            count.cycles as f64 / ours.0.cycles as f64
        );
    }
}

/// Neural, against C.
fn neural() -> Result<(), Box<dyn Error>> {
    let ours = Binary::new(TARGETS[0], Functions::Libm, "neural");
    let directory = tempfile::tempdir()?;
    fs::write(directory.path().join("numbers.h"), numbers()?)?;
    let expected = ours.run().numbers("parameters");

    let count = of_fit(&ours, BRDF_READINGS);
    println!(
        "Neural by glimpse: {} instructions, {} cycles",
        count.instructions, count.cycles
    );
    let own = count;
    for options in [&["-O3"][..], &["-O3", "-ffast-math"]] {
        let rival = Binary::at(TARGETS[0], compile(directory.path(), options)?);
        let found = rival.run().numbers("parameters");
        let distance = expected.iter().zip(&found).map(|(a, b)| (a - b).abs());
        let distance = distance.fold(0.0, f32::max);
        // Their exponentials differ in the last place.
        if found.len() != expected.len() || distance > 1e-3 {
            return Err(format!("C ends elsewhere: {distance} off").into());
        }
        let count = of_fit(&rival, 0);
        println!(
            "Neural by C {}: {} instructions, {} cycles, {:.2} and {:.2} times as many; parameters within \
             {distance:.0e}",
            options.join(" "),
            count.instructions,
            count.cycles,
            count.instructions as f64 / own.instructions as f64,
            count.cycles as f64 / own.cycles as f64,
        );
    }
    Ok(())
}

/// The recipe and the measurements as C.
fn numbers() -> Result<String, Box<dyn Error>> {
    let recipe = Recipe::parse(recipes::NEURAL).map_err(|error| format!("{error:?}"))?;
    let FitMethod::Descent(descent) = recipe.method() else {
        return Err("the recipe is not of Neural".into());
    };
    let list = |values: &mut dyn Iterator<Item = f32>| {
        let values: Vec<String> = values.map(|value| format!("{value:e}f")).collect();
        values.join(", ")
    };
    let mut header = format!("#define SAMPLES {}\n", recipe.samples());
    for (name, values) in [
        ("INITIAL", descent.initial()),
        ("STEP_SIZES", descent.step_sizes()),
    ] {
        let values = list(&mut values.iter());
        writeln!(header, "static const float {name}[] = {{{values}}};")?;
    }
    let (mut inputs, mut measured) = (String::new(), String::new());
    for angles in recipe.pattern() {
        let at = HalfDifference::from_angles(angles);
        let input = [at.hx, 0.0, at.hz, at.dx, at.dy, at.dz];
        writeln!(inputs, "{{{}}},", list(&mut input.into_iter()))?;
        writeln!(
            measured,
            "{{{}}},",
            list(&mut measure(angles).brdf.into_iter())
        )?;
    }
    writeln!(header, "static const float INPUTS[][6] = {{\n{inputs}}};")?;
    writeln!(
        header,
        "static const float MEASURED[][3] = {{\n{measured}}};"
    )?;
    Ok(header)
}

/// Compiles the rival; returns the ELF file.
fn compile(directory: &Path, options: &[&str]) -> Result<std::path::PathBuf, Box<dyn Error>> {
    let rivals = Path::new(env!("CARGO_MANIFEST_DIR")).join("../embedded-demo/bench/rivals");
    let out = directory.join(format!("rival{}", options.join("")));
    let status = Command::new("arm-none-eabi-gcc")
        .args([
            "-mcpu=cortex-m4",
            "-mfpu=fpv4-sp-d16",
            "-mfloat-abi=hard",
            "-mthumb",
        ])
        .args(options)
        .args(["-nostartfiles", "-Wall", "-Werror", "-I"])
        .arg(directory)
        .arg("-T")
        .arg(rivals.join("board.ld"))
        .arg(rivals.join("neural.c"))
        .args(["-lm", "-o"])
        .arg(&out)
        .status()
        .map_err(|error| format!("arm-none-eabi-gcc: {error}"))?;
    match status.success() {
        true => Ok(out),
        false => Err(format!("arm-none-eabi-gcc: {status}").into()),
    }
}
