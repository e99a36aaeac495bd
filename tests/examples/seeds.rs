//! Writes the seeds of the trainer's fuzz targets, trainer/fuzz/seeds: small files of every format, valid
//! and damaged in every way that has a name, made of procedural materials. Those that fuzzing has found
//! (`found-*`) stay as they are.
//!
//!     cargo run --release -p glimpse-tests --example seeds

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use glimpse_core::geometry::Angles;
use glimpse_core::model::{ModelKind, NeuralParameters, ParameterSet};
use glimpse_optimizer::{Groups, Optimization};
use glimpse_trainer::material::{FittedMaterial, Material, Procedural, to_nbrdf, to_pab};
use glimpse_trainer::meta::checkpoint::Checkpoint;
use glimpse_trainer::meta::state::RunState;
use glimpse_trainer::render::Image;

type Outcome = Result<(), Box<dyn Error>>;

fn main() -> Outcome {
    let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("../trainer/fuzz/seeds");
    let material = Procedural::new(3, 7);
    damages(&Folder::new(&seeds, "merl")?, 35_000_000)?;
    damages(&Folder::new(&seeds, "basis")?, 1_000_000)?;
    nbrdf(&Folder::new(&seeds, "nbrdf")?)?;
    let tensors = tensors(&material);
    rgl(&Folder::new(&seeds, "rgl")?, &tensors)?;
    let texts = texts(&material)?;
    pab(&Folder::new(&seeds, "pab")?, &texts)?;
    format(&Folder::new(&seeds, "format")?, &tensors.bytes(), &texts[0])?;
    readings(&Folder::new(&seeds, "readings")?, &material)?;
    device(&Folder::new(&seeds, "device")?)?;
    fitted(&Folder::new(&seeds, "material")?)?;
    checkpoint(&Folder::new(&seeds, "checkpoint")?)?;
    environment(&Folder::new(&seeds, "environment")?)
}

/// The seeds of one target.
struct Folder(PathBuf);

impl Folder {
    fn new(seeds: &Path, target: &str) -> Result<Self, Box<dyn Error>> {
        let path = seeds.join(target);
        fs::create_dir_all(&path)?;
        Ok(Self(path))
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> Outcome {
        Ok(fs::write(self.0.join(name), bytes)?)
    }

    /// A valid file, and the same cut in the middle and at its last byte, and with a byte too many.
    fn write_lengths(&self, name: &str, bytes: &[u8]) -> Outcome {
        self.write(name, bytes)?;
        self.write(&format!("{name}-half"), &bytes[..bytes.len() / 2])?;
        self.write(&format!("{name}-short"), &bytes[..bytes.len() - 1])?;
        self.write(&format!("{name}-long"), [bytes, b"0"].concat())
    }
}

/// Of a large file: how it is damaged; see `Damage` of the targets.
fn damages(folder: &Folder, far: u32) -> Outcome {
    let patch = |place: u32, bytes: [u8; 8]| [&place.to_le_bytes()[..], &bytes].concat();
    let damaged =
        |longer: i32, patches: &[Vec<u8>]| [&longer.to_le_bytes()[..], &patches.concat()].concat();
    let places = [0, 2 * 4, 2 * 8, 2 * 20, 2 * 24, 2 * far + 1];
    folder.write("valid", damaged(0, &[]))?;
    for longer in [-1, -8, -1_000_000, i32::MIN, 1, 8] {
        folder.write(&format!("longer-{longer}"), damaged(longer, &[]))?;
    }
    for (name, bytes) in [
        ("nan", f64::NAN.to_le_bytes()),
        ("infinite", f64::INFINITY.to_le_bytes()),
        ("negative", (-1.0_f64).to_le_bytes()),
        ("big-endian", 0.01_f64.to_be_bytes()),
        ("ones", [0xff; 8]),
    ] {
        for place in places {
            folder.write(
                &format!("{name}-{place}"),
                damaged(0, &[patch(place, bytes)]),
            )?;
        }
    }
    Ok(())
}

fn nbrdf(folder: &Folder) -> Outcome {
    let mut network = NeuralParameters::filled(0.0);
    for (index, run) in network.runs_mut().enumerate() {
        for (place, weight) in run.iter_mut().enumerate() {
            *weight = ((place * 7 + index) % 11) as f32 * 0.05 - 0.25;
        }
    }
    let files = to_nbrdf(&network);
    for (which, (ending, bytes)) in files.iter().enumerate() {
        let input = [&[which as u8][..], bytes].concat();
        folder.write_lengths(ending.trim_start_matches('_'), &input)?;
    }
    let replaced = |which: u8, from: &str, to: &str| {
        let (head, values) = files[usize::from(which)].1.split_at(128);
        let head = String::from_utf8_lossy(&head[10..]).replace(from, to);
        [
            &[which][..],
            b"\x93NUMPY\x01\0",
            &(head.len() as u16).to_le_bytes(),
            head.as_bytes(),
            values,
        ]
        .concat()
    };
    for (name, which, from, to) in [
        ("double", 1, "<f4", "<f8"),
        ("big-endian", 1, "<f4", ">f4"),
        ("integers", 1, "<f4", "<i4"),
        ("fortran", 0, "False", "True"),
        ("transposed", 0, "6,21", "21,6"),
        ("beyond", 1, "(21,)", "(4611686018427387904,)"),
        ("no-shape", 1, "'shape'", "'form'"),
        ("record", 1, "'<f4'", "[('a', '<f4')]"),
    ] {
        folder.write(name, replaced(which, from, to))?;
    }
    for (name, value) in [
        ("nan", f32::NAN),
        ("infinite", f32::INFINITY),
        ("huge", f32::MAX),
    ] {
        let mut bytes = [&[1][..], &files[1].1].concat();
        let last = bytes.len() - 4;
        bytes[last..].copy_from_slice(&value.to_le_bytes());
        folder.write(name, bytes)?;
    }
    folder.write(
        "version-2",
        b"\x01\x93NUMPY\x02\x00\xff\xff\xff\xff{'descr'",
    )
}

/// A tensor file: name, type, shape and bytes of each field.
#[derive(Clone)]
struct Tensors(Vec<(String, u8, Vec<u64>, Vec<u8>)>);

impl Tensors {
    fn push(&mut self, name: &str, shape: &[u64], values: &[f32]) {
        let bytes = values
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect();
        self.0.push((name.to_owned(), 10, shape.to_vec(), bytes));
    }

    fn bytes(&self) -> Vec<u8> {
        let header = self
            .0
            .iter()
            .map(|(name, _, shape, _)| 13 + name.len() + 8 * shape.len());
        let mut begin = 18 + header.sum::<usize>();
        let mut bytes = b"tensor_file\0\x01\0".to_vec();
        bytes.extend((self.0.len() as u32).to_le_bytes());
        for (name, kind, shape, values) in &self.0 {
            bytes.extend((name.len() as u16).to_le_bytes());
            bytes.extend(name.as_bytes());
            bytes.extend((shape.len() as u16).to_le_bytes());
            bytes.push(*kind);
            bytes.extend((begin as u64).to_le_bytes());
            bytes.extend(shape.iter().flat_map(|length| length.to_le_bytes()));
            begin += values.len();
        }
        bytes.extend(self.0.iter().flat_map(|(.., values)| values));
        bytes
    }

    /// With one field changed.
    fn with(&self, name: &str, change: impl Fn(&mut (String, u8, Vec<u64>, Vec<u8>))) -> Vec<u8> {
        let mut other = self.clone();
        other
            .0
            .iter_mut()
            .filter(|field| field.0 == name)
            .for_each(change);
        other.bytes()
    }
}

/// What a measurement of a material holds, in a few nodes.
fn tensors(material: &dyn Material) -> Tensors {
    let theta_i = [0.0_f32, 0.6, 1.5];
    let brdf = |theta_d: f32, theta_h: f32| {
        material.brdf(Angles {
            theta_h,
            theta_d,
            phi_d: 0.3,
        })
    };
    let mut rgb = Vec::new();
    for theta in theta_i {
        for channel in 0..3 {
            rgb.extend((0..6).map(|node| brdf(0.9 * theta, 0.1 * node as f32)[channel]));
        }
    }
    let mut tensors = Tensors(vec![
        ("description".into(), 1, vec![4], b"seed".to_vec()),
        ("jacobian".into(), 1, vec![1], vec![1]),
    ]);
    tensors.push("phi_i", &[1], &[0.0]);
    tensors.push("theta_i", &[3], &theta_i);
    tensors.push("ndf", &[2, 4], &[0.4, 0.3, 0.2, 0.1, 0.4, 0.3, 0.2, 0.1]);
    tensors.push("sigma", &[2, 2], &[1.0, 0.5, 1.0, 0.5]);
    tensors.push("vndf", &[1, 3, 2, 2], &[0.25; 12]);
    tensors.push("rgb", &[1, 3, 3, 2, 3], &rgb);
    tensors
}

fn rgl(folder: &Folder, tensors: &Tensors) -> Outcome {
    folder.write_lengths("valid", &tensors.bytes())?;
    let mut big_endian = tensors.bytes();
    big_endian[14..18].reverse();
    folder.write("big-endian", big_endian)?;
    folder.write(
        "spectral",
        tensors.with("rgb", |field| field.0 = "spectra".into()),
    )?;
    folder.write(
        "anisotropic",
        tensors.with("phi_i", |field| {
            field.2 = vec![3];
            field.3 = vec![0; 12];
        }),
    )?;
    folder.write(
        "double",
        tensors.with("ndf", |field| {
            field.1 = 11;
            field.2 = vec![2, 2];
        }),
    )?;
    folder.write(
        "beyond",
        tensors.with("ndf", |field| field.2 = vec![1 << 63, 2]),
    )?;
    folder.write(
        "wraps",
        tensors.with("ndf", |field| field.2 = vec![1 << 32, 1 << 32]),
    )?;
    folder.write(
        "none",
        tensors.with("vndf", |field| field.2 = vec![1, 3, 0, 1 << 40]),
    )?;
    for (name, value) in [
        ("nan", f32::NAN),
        ("infinite", f32::INFINITY),
        ("negative", -1.0),
        ("huge", f32::MAX),
    ] {
        for field in ["theta_i", "ndf", "sigma", "vndf", "rgb"] {
            let bytes = tensors.with(field, |field| {
                field.3[4..8].copy_from_slice(&value.to_le_bytes())
            });
            folder.write(&format!("{name}-{field}"), bytes)?;
        }
    }
    Ok(())
}

/// Every fiftieth line of a set's first three files.
fn texts(material: &dyn Material) -> Result<Vec<String>, Box<dyn Error>> {
    let texts = to_pab("seed", material)?;
    let few = texts.iter().take(3).map(|text| {
        let (header, values): (Vec<_>, Vec<_>) =
            text.lines().partition(|line| line.starts_with('#'));
        let values: Vec<&str> = values.into_iter().step_by(200).collect();
        let header = header
            .iter()
            .map(|line| match line.split_whitespace().next() {
                Some("#values") => format!("#values {}", values.len()),
                Some("#set_intheta") => "#set_intheta 0 10 20".to_owned(),
                _ => (*line).to_owned(),
            });
        let lines: Vec<String> = header
            .chain(values.iter().map(|line| (*line).to_owned()))
            .collect();
        lines.join("\n") + "\n"
    });
    Ok(few.collect())
}

fn pab(folder: &Folder, texts: &[String]) -> Outcome {
    let whole = texts.join("\0");
    folder.write_lengths("valid", whole.as_bytes())?;
    folder.write("lacks-one", texts[..2].join("\0"))?;
    folder.write("twice", [&texts[0][..], &texts[0], &texts[1]].join("\0"))?;
    let others = texts[0]
        .replace("#set_intheta 0 10 20\n", "")
        .replace("#values", "#lines");
    for (name, from, to) in [
        ("alone", "", ""),
        ("dos", "\n", "\r\n"),
        ("grey", "CIE-XYZ", "CIE-Y"),
        ("times-cosine", "BRDF", "DSF"),
        ("transmitted", "BRDF", "BTDF"),
        ("spectral", "CIE-XYZ", "RGB-spectral-31"),
        ("decimal-commas", "0.", "0,"),
        ("anisotropic", "#inphi 0", "#inphi 90"),
        ("from-below", "#intheta 0", "#intheta 120"),
        ("nan", "e-1", "nan"),
        ("infinite", "e-1", "e999"),
        ("huge", "e-1", "e300"),
        ("negative", " 1.", " -1."),
        ("slashes", "seed", "../../seed"),
    ] {
        folder.write(name, others.replace(from, to))?;
    }
    Ok(())
}

fn format(folder: &Folder, tensors: &[u8], text: &str) -> Outcome {
    let merl: Vec<u8> = [90_i32, 90, 180]
        .iter()
        .flat_map(|nodes| nodes.to_le_bytes())
        .collect();
    for (name, bytes) in [
        ("merl", &merl[..]),
        ("rgl", &tensors[..40]),
        ("pab", text.as_bytes()),
        ("layerlab", b"SCATFUN\x01\0\0"),
        ("zemax", b"# comment\r\nSource  Measured\r\n"),
        ("xml", b"\xef\xbb\xbf<?xml version=\"1.0\"?><WindowElement>"),
        ("hdf", b"\x89HDF\r\n\x1a\n"),
        ("numpy", b"\x93NUMPY\x01\0"),
        ("notes", b"notes"),
        ("nothing", b""),
    ] {
        for which in 0..6_u8 {
            folder.write(&format!("{name}-{which}"), [&[which][..], bytes].concat())?;
        }
    }
    Ok(())
}

fn readings(folder: &Folder, material: &dyn Material) -> Outcome {
    // The first places of the target, in degrees.
    let places = [
        [0.0, 0.0, 0.0],
        [11.459, 17.189, 22.918],
        [40.107, 28.648, 355.234],
    ];
    let mut rows = String::from("theta_h,theta_d,phi_d,r,g,b,saturated\n");
    for place in places {
        let [theta_h, theta_d, phi_d] = place.map(|degrees: f32| degrees.to_radians());
        let brdf = material.brdf(Angles {
            theta_h,
            theta_d,
            phi_d,
        });
        let cells = place.iter().chain(&brdf).map(f32::to_string);
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

fn device(folder: &Folder) -> Outcome {
    let recipe = include_str!("../../trainer/fuzz/fuzz_targets/device.rs");
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

fn fitted(folder: &Folder) -> Outcome {
    for model in [ModelKind::Phong, ModelKind::CookTorrance, ModelKind::Neural] {
        let values = (0..model.parameters().unwrap_or_default())
            .map(|index| 0.1 + 0.01 * (index % 7) as f32);
        let Some(material) = FittedMaterial::new("seed".into(), model, values.collect(), None)
        else {
            return Err("not as many values as the model has".into());
        };
        let about = std::collections::BTreeMap::from([("residual", 0.5)]);
        let text = material.to_json(None, about)?;
        folder.write_lengths(model.name(), text.as_bytes())?;
        if model != ModelKind::Phong {
            continue;
        }
        for (name, from, to) in [
            ("version-2", "\"version\": 1", "\"version\": 2"),
            (
                "version-2-without-values",
                "\"version\": 1",
                "\"version\": 2, \"values\": 3, \"old\": 1",
            ),
            ("other-format", "glimpse-material", "material"),
            ("other-model", "phong", "lambert"),
            ("linear", "phong", "linear"),
            ("huge", "0.1,", "1e300,"),
            ("nan", "0.1,", "NaN,"),
            ("few", "0.1,", ""),
            ("slashes", "seed", "../seed"),
            ("no-name", "seed", ""),
            (
                "basis",
                "\"basis\": null",
                "\"basis\": {\"file\": \"/dev/null\", \"checksum\": \"00000001\"}",
            ),
        ] {
            folder.write(name, text.replace(from, to))?;
        }
        let linear = text.replace("phong", "linear");
        for (name, file) in [
            ("linear-zero", "/dev/zero"),
            ("linear-none", "none.basis"),
            ("linear-itself", "."),
        ] {
            let basis = format!("\"basis\": {{\"file\": \"{file}\", \"checksum\": \"00000001\"}}");
            folder.write(name, linear.replace("\"basis\": null", &basis))?;
        }
    }
    folder.write("deep", "[".repeat(2000))
}

fn checkpoint(folder: &Folder) -> Outcome {
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
    let mut optimization = Optimization::new(values.clone());
    optimization.step(values, &rates);
    let path = folder.0.join("valid");
    for (name, run) in [("valid", "a run"), ("other-run", "another")] {
        let checkpoint = Checkpoint {
            run: run.into(),
            state: RunState::default(),
            record: optimization.record(),
        };
        checkpoint.write(&path)?;
        let bytes = fs::read(&path)?;
        // With the checksum as it is, and put right once it was damaged.
        folder.write_lengths(name, &[&[0][..], &bytes].concat())?;
        folder.write_lengths(&format!("{name}-mended"), &[&[1][..], &bytes].concat())?;
    }
    Ok(())
}

fn environment(folder: &Folder) -> Outcome {
    let (width, height) = (8, 4);
    let mut panorama = Image::filled(width, height, [0.5, 0.25, 0.125]);
    panorama.pixels[12] = [16.0, 8.0, 4.0];
    folder.write_lengths("exr", &panorama.to_exr()?)?;
    panorama.pixels[12] = [f32::MAX; 3];
    folder.write("exr-huge", panorama.to_exr()?)?;
    let radiance = |size: &str| {
        let header = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{size}\n");
        [
            header.as_bytes(),
            &[128, 64, 32, 128].repeat(width * height),
        ]
        .concat()
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
