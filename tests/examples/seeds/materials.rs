//! Seeds for the readers of material formats, except tensor files.

use std::collections::BTreeMap;
use std::error::Error;

use glimpse_core::model::{ModelKind, Neural, NeuralParameters, ParameterSet};
use glimpse_materials::{FittedBrdf, FittedMaterial, Material, to_nbrdf, to_pab};

use crate::{SeedResult, Seeds};

/// Writes seeds of the reader `nbrdf`: a byte with the index of a file of the set, then that file.
pub(crate) fn nbrdf(seeds: &Seeds) -> SeedResult {
    let mut network = NeuralParameters::filled(0.0);
    let mut rest = &mut network[..];
    for (index, length) in Neural::LAYERS.into_iter().enumerate() {
        let (layer, after) = rest.split_at_mut(length);
        for (entry, weight) in layer.iter_mut().enumerate() {
            *weight = ((entry * 7 + index) % 11) as f32 * 0.05 - 0.25;
        }
        rest = after;
    }
    let files = to_nbrdf(&network);
    for (file, (suffix, bytes)) in files.iter().enumerate() {
        let input = [&[file as u8][..], bytes].concat();
        seeds.write_lengths(suffix.trim_start_matches('_'), &input)?;
    }
    // A file of NumPy has 10 bytes of magic number, version and length, then a header of text up to byte 128.
    let with_replaced_header = |file: u8, from: &str, to: &str| {
        let (header, values) = files[usize::from(file)].1.split_at(128);
        let header = String::from_utf8_lossy(&header[10..]).replace(from, to);
        [
            &[file][..],
            b"\x93NUMPY\x01\0",
            &(header.len() as u16).to_le_bytes(),
            header.as_bytes(),
            values,
        ]
        .concat()
    };
    for (name, file, from, to) in [
        ("double", 1, "<f4", "<f8"),
        ("big-endian", 1, "<f4", ">f4"),
        ("integers", 1, "<f4", "<i4"),
        ("fortran", 0, "False", "True"),
        ("transposed", 0, "6,21", "21,6"),
        ("shape-overflow", 1, "(21,)", "(4611686018427387904,)"),
        ("no-shape", 1, "'shape'", "'form'"),
        ("record", 1, "'<f4'", "[('a', '<f4')]"),
    ] {
        seeds.write(name, with_replaced_header(file, from, to))?;
    }
    for (name, value) in [
        ("nan", f32::NAN),
        ("infinite", f32::INFINITY),
        ("huge", f32::MAX),
    ] {
        let mut bytes = [&[1][..], &files[1].1].concat();
        let last = bytes.len() - 4;
        bytes[last..].copy_from_slice(&value.to_le_bytes());
        seeds.write(name, bytes)?;
    }
    seeds.write(
        "version-2",
        b"\x01\x93NUMPY\x02\x00\xff\xff\xff\xff{'descr'",
    )
}

/// Returns the first three PAB-Opto files of a material, each with every 200th line of values.
pub(crate) fn pab_texts(material: &dyn Material) -> Result<Vec<String>, Box<dyn Error>> {
    let texts = to_pab("seed", material)?;
    let shortened = texts.iter().take(3).map(|text| {
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
    Ok(shortened.collect())
}

/// Writes seeds of the reader `pab`: the files of a set, separated by zero bytes.
pub(crate) fn pab(seeds: &Seeds, texts: &[String]) -> SeedResult {
    seeds.write_lengths("valid", texts.join("\0").as_bytes())?;
    seeds.write("missing-file", texts[..2].join("\0"))?;
    seeds.write(
        "repeated-file",
        [&texts[0][..], &texts[0], &texts[1]].join("\0"),
    )?;
    let single = texts[0]
        .replace("#set_intheta 0 10 20\n", "")
        .replace("#values", "#lines");
    for (name, from, to) in [
        ("single-file", "", ""),
        ("dos", "\n", "\r\n"),
        ("gray", "CIE-XYZ", "CIE-Y"),
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
        seeds.write(name, single.replace(from, to))?;
    }
    Ok(())
}

/// Writes seeds of the reader `material`: a byte that selects the file name, then the first bytes of a file.
pub(crate) fn format(seeds: &Seeds, tensors: &[u8], text: &str) -> SeedResult {
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
        ("empty", b""),
    ] {
        for file_name in 0..6_u8 {
            let bytes = [&[file_name][..], bytes].concat();
            seeds.write(&format!("{name}-{file_name}"), bytes)?;
        }
    }
    Ok(())
}

/// Writes seeds of the reader `material`: the byte that selects a name `*.json`, then fitted materials as JSON.
pub(crate) fn fitted(seeds: &Seeds) -> SeedResult {
    for model in [ModelKind::Phong, ModelKind::CookTorrance, ModelKind::Neural] {
        let values = (0..model.parameters().unwrap_or_default())
            .map(|index| 0.1 + 0.01 * (index % 7) as f32);
        let fitted = FittedBrdf::new(model, values.collect(), None);
        let Some(material) = fitted.and_then(|fitted| FittedMaterial::new("seed".into(), fitted))
        else {
            return Err("the number of values does not match the model".into());
        };
        let metadata = BTreeMap::from([("residual", 0.5)]);
        let text = "\u{2}".to_owned() + &material.to_json(None, metadata)?;
        seeds.write_lengths(model.name(), text.as_bytes())?;
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
            seeds.write(name, text.replace(from, to))?;
        }
        let linear = text.replace("phong", "linear");
        for (name, file) in [
            ("linear-zero", "/dev/zero"),
            ("linear-missing-file", "none.basis"),
            ("linear-folder", "."),
        ] {
            let basis = format!("\"basis\": {{\"file\": \"{file}\", \"checksum\": \"00000001\"}}");
            seeds.write(name, linear.replace("\"basis\": null", &basis))?;
        }
    }
    seeds.write("deep", "\u{2}".to_owned() + &"[".repeat(2000))
}
