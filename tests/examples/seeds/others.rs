//! Seeds of other files: readings and checkpoints.

use std::fs;

use glimpse_core::geometry::Angles;
use glimpse_materials::Material;
use glimpse_optimizer::{Groups, Optimizer};
use glimpse_trainer_fuzz::checkpoint::RUN;
use glimpse_training::meta::checkpoint::{Checkpoint, RunState};
use glimpse_training::meta::identity::RunIdentity;

use crate::{SeedResult, Seeds};

pub(crate) fn readings(seeds: &Seeds, material: &dyn Material) -> SeedResult {
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
    seeds.write_lengths("valid", rows.as_bytes())?;
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
        seeds.write(name, rows.replace(from, to))?;
    }
    let utf_16: Vec<u8> = "\u{feff}"
        .encode_utf16()
        .chain(rows.encode_utf16())
        .flat_map(u16::to_le_bytes)
        .collect();
    seeds.write("utf-16", utf_16)?;
    seeds.write("indexed", "index,value\n0,0.1\n2.0,0.2\n1,\n")?;
    seeds.write(
        "directions",
        "theta_i,phi_i,theta_o,phi_o,r,g,b\n0,0,0,0,1,1,1\n",
    )?;
    seeds.write("nothing", "")
}

pub(crate) fn checkpoint(seeds: &Seeds) -> SeedResult {
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
    let other = RunIdentity { options: 8, ..RUN };
    for (name, identity) in [("valid", RUN), ("other-run", other)] {
        let checkpoint = Checkpoint {
            identity,
            state: RunState::default(),
            record: optimizer.record(),
        };
        checkpoint.write(&path)?;
        let bytes = fs::read(&path)?;
        // Once with the damaged checksum, and once with instructions to correct it.
        seeds.write_lengths(name, &[&[0][..], &bytes].concat())?;
        seeds.write_lengths(&format!("{name}-mended"), &[&[1][..], &bytes].concat())?;
    }
    seeds.write("other-version", [&b"\0GLC2"[..], &[0; 40]].concat())
}
