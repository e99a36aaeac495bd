//! Compares the cost of fits with other implementations, on the same emulated Cortex-M4F with the same recipe and
//! readings.
//!
//! For Neural, the other implementation is plain C, compiled by `arm-none-eabi-gcc -O3`; its parameters are the same.
//! For Phong, it is multicalc's Levenberg-Marquardt; its parameters differ, so both fits are evaluated at other
//! directions.
//!
//! `tests/run firmware` installs and builds the requirements, except the Debian packages gcc-arm-none-eabi and
//! libnewlib-arm-none-eabi.

use std::error::Error;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::Command;

use glimpse_bench::evaluation::loss;
use glimpse_bench::{Material, measure, recipes};
use glimpse_core::fit::Estimator;
use glimpse_core::geometry::HalfDifference;
use glimpse_core::model::Phong;
use glimpse_core::recipe::Recipe;
use glimpse_tests::cycles::fit_cost;
use glimpse_tests::figures::CALLS_AFTER_FIT;
use glimpse_tests::microcontroller::{Binary, MathLibrary, TARGETS};

fn main() -> Result<(), Box<dyn Error>> {
    neural()?;
    phong();
    Ok(())
}

/// Compares Phong with multicalc.
fn phong() {
    let [ours, rival] = ["phong", "rival-phong"].map(|name| {
        let binary = Binary::new(TARGETS[0], MathLibrary::Libm, name);
        let output = binary.run();
        let loss = loss::<Phong>(&output.numbers("parameters"), &Material::BENCHMARK);
        let calls_after_fit = output
            .get("brdf_instructions")
            .map_or(0, |_| CALLS_AFTER_FIT);
        (
            fit_cost(&binary, calls_after_fit),
            output.count("stack_bytes"),
            loss,
        )
    });
    for (name, (count, stack, loss)) in [("glimpse", ours), ("multicalc", rival)] {
        println!(
            "Phong with {name}: {} instructions, {} cycles, {stack} bytes of stack, loss {loss:.4}; \
             {:.2} times the cycles",
            count.instructions,
            count.cycles,
            count.cycles as f64 / ours.0.cycles as f64
        );
    }
}

/// Compares Neural with C.
fn neural() -> Result<(), Box<dyn Error>> {
    let ours = Binary::new(TARGETS[0], MathLibrary::Libm, "neural");
    let directory = tempfile::tempdir()?;
    fs::write(directory.path().join("numbers.h"), header()?)?;
    let expected = ours.run().numbers("parameters");

    let count = fit_cost(&ours, CALLS_AFTER_FIT);
    println!(
        "Neural with glimpse: {} instructions, {} cycles",
        count.instructions, count.cycles
    );
    let glimpse = count;
    for options in [&["-O3"][..], &["-O3", "-ffast-math"]] {
        let rival = Binary::at(TARGETS[0], compile(directory.path(), options)?);
        let actual = rival.run().numbers("parameters");
        let distance = expected.iter().zip(&actual).map(|(a, b)| (a - b).abs());
        let distance = distance.fold(0.0, f32::max);
        // The exponential functions differ in the last place.
        if actual.len() != expected.len() || distance > 1e-3 {
            return Err(format!("parameters of C and glimpse differ by {distance}").into());
        }
        let count = fit_cost(&rival, 0);
        println!(
            "Neural with C {}: {} instructions, {} cycles, {:.2} and {:.2} times as many; parameters within \
             {distance:.0e}",
            options.join(" "),
            count.instructions,
            count.cycles,
            count.instructions as f64 / glimpse.instructions as f64,
            count.cycles as f64 / glimpse.cycles as f64,
        );
    }
    Ok(())
}

/// Returns the recipe and the readings as a C header.
fn header() -> Result<String, Box<dyn Error>> {
    let recipe = Recipe::parse(recipes::NEURAL).map_err(|error| format!("{error:?}"))?;
    let Estimator::Sgd(sgd) = recipe.estimator() else {
        return Err("the recipe is not of Neural".into());
    };
    let list = |values: &mut dyn Iterator<Item = f32>| {
        let values: Vec<String> = values.map(|value| format!("{value:e}f")).collect();
        values.join(", ")
    };
    let mut header = format!("#define SAMPLES {}\n", recipe.samples());
    for (name, values) in [("INITIAL", sgd.initial), ("STEP_SIZES", sgd.step_sizes)] {
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

/// Compiles the C implementation and returns the path of its ELF file.
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
