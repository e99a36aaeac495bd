//! Seeds of other files: readings, reports of devices, checkpoints and environments.

use std::fs;

use glimpse_core::geometry::Angles;
use glimpse_materials::Material;
use glimpse_optimizer::{Groups, Optimizer};
use glimpse_trainer_fuzz::checkpoint::RUN;
use glimpse_training::meta::checkpoint::Checkpoint;
use glimpse_training::meta::identity::RunIdentity;
use glimpse_training::meta::state::RunState;

use crate::{Folder, SeedResult};

pub(crate) fn readings(folder: &Folder, material: &dyn Material) -> SeedResult {
    // The first samples of the target's pattern, in degrees.
    let samples = [
        [0.0, 0.0, 0.0],
        [11.459, 17.189, 22.918],
        [40.107, 28.648, 355.234],
    ];
    let mut rows = String::from("theta_h,theta_d,phi_d,r,g,b,saturated\n");
    for angles in samples {
        let [theta_h, theta_d, phi_d] = angles.map(|degrees: f32| degrees.to_radians());
        let brdf = material.brdf(Angles {
            theta_h,
            theta_d,
            phi_d,
        });
        let cells = angles.iter().chain(&brdf).map(f32::to_string);
        rows += &(cells.collect::<Vec<_>>().join(",") + ",0\n");
    }
    folder.write_lengths("valid", rows.as_bytes())?;
    for (name, from, to) in [
        ("dos", "\n", "\r\n"),
        ("mac", "\n", "\r"),
        ("mark", "theta_h", "\u{feff}theta_h"),
        ("semicolons", ",", ";"),
        ("tabs", ",", "\t"),
        ("decimal-commas", ".", ","),
        ("no-number", "0.", "x."),
        ("nan", ",0\n", ",nan\n"),
        ("not-read", "0,0,0,", "0,0,0,,,,"),
        ("negative", ",0.", ",-0."),
        ("huge", ",0.", ",1e39"),
        ("radians", "11.459,17.189,22.918", "0.2,0.3,0.4"),
        ("times", "theta_h,theta_d", "time,theta_h"),
        ("twice", "theta_h", "theta_d"),
        ("quoted", "theta_h", "\"theta_h"),
        ("escape", "theta_h", "\u{1b}[2Jtheta_h"),
    ] {
        folder.write(name, rows.replace(from, to))?;
    }
    let utf_16: Vec<u8> = "\u{feff}"
        .encode_utf16()
        .chain(rows.encode_utf16())
        .flat_map(u16::to_le_bytes)
        .collect();
    folder.write("utf-16", utf_16)?;
    folder.write("indexed", "index,value\n0,0.1\n2.0,0.2\n1,\n")?;
    folder.write(
        "directions",
        "theta_i,phi_i,theta_o,phi_o,r,g,b\n0,0,0,0,1,1,1\n",
    )?;
    folder.write("nothing", "")
}

pub(crate) fn device(folder: &Folder) -> SeedResult {
    let recipe = include_str!("../../../trainer/fuzz/src/device.rs");
    assert!(recipe.contains("phong-n8.recipe"));
    let values = "[0.5, 0.4, 0.3, 0.1, 0.1, 0.1, 20.0]";
    let text =
        format!("{{\"model\": \"phong\", \"recipe\": \"CHECKSUM\", \"values\": {values}}}\n");
    let residual = r#", "residual": {"mean": 0.1, "worst_index": 3, "worst": 0.2, "saturated": 0, "repeated": 0, "clamped": 0}}"#;
    let reading = r#", "readings": [{"theta_h": 0.1, "theta_d": 0.2, "phi_d": 0.3, "brdf": [0.1, 0.1, 0.1]}]}"#;
    folder.write_lengths("valid", text.as_bytes())?;
    for (name, from, to) in [
        ("residual", "}", residual),
        ("reading", "}", reading),
        ("other-recipe", "CHECKSUM", "01234567"),
        ("other-model", "phong", "neural"),
        ("huge", "20.0", "1e300"),
        ("words", "20.0", "\"twenty\""),
        ("nan", "20.0", "NaN"),
        ("decimal-commas", "20.0", "20,0"),
        ("nothing", &text[..], ""),
    ] {
        folder.write(name, text.replace(from, to))?;
    }
    Ok(())
}

pub(crate) fn checkpoint(folder: &Folder) -> SeedResult {
    let values = Groups {
        initial: vec![0.5; 7],
        hyperparameters: vec![-1.0; 7],
        pattern: vec![2.0; 3],
        ..Groups::default()
    };
    let rates = Groups {
        initial: 1e-3,
        hyperparameters: 1e-3,
        pattern: 1e-3,
        ..Groups::default()
    };
    let mut optimizer = Optimizer::new(values.clone());
    optimizer.step(values, &rates);
    let directory = tempfile::tempdir()?;
    let path = directory.path().join("checkpoint");
    let other = RunIdentity { seed: 8, ..RUN };
    for (name, identity) in [("valid", RUN), ("other-run", other)] {
        let checkpoint = Checkpoint {
            identity,
            state: RunState::default(),
            record: optimizer.record(),
        };
        checkpoint.write(&path)?;
        let bytes = fs::read(&path)?;
        // Once with the damaged checksum, and once with instructions to correct it.
        folder.write_lengths(name, &[&[0][..], &bytes].concat())?;
        folder.write_lengths(&format!("{name}-mended"), &[&[1][..], &bytes].concat())?;
    }
    folder.write("other-version", [&b"\0GLC2"[..], &[0; 40]].concat())
}

pub(crate) fn environment(folder: &Folder) -> SeedResult {
    let radiance = |size: &str| {
        let header = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{size}\n");
        [header.as_bytes(), &[128, 64, 32, 128].repeat(8 * 4)].concat()
    };
    folder.write_lengths("hdr", &radiance("-Y 4 +X 8"))?;
    for (name, size) in [
        ("many", "-Y 60000 +X 60000"),
        ("square", "-Y 8 +X 4"),
        ("none", "-Y 0 +X 0"),
    ] {
        folder.write(&format!("hdr-{name}"), radiance(size))?;
    }
    Ok(())
}
