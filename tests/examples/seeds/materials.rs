//! Seeds of material formats other than tensor files.

use std::collections::BTreeMap;
use std::error::Error;

use glimpse_core::model::{ModelKind, Neural, NeuralParameters, ParameterSet};
use glimpse_materials::{FittedBrdf, FittedMaterial, Material, to_nbrdf, to_pab};

use crate::{Folder, SeedResult};

pub(crate) fn nbrdf(folder: &Folder) -> SeedResult {
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
    for (file, (ending, bytes)) in files.iter().enumerate() {
        let input = [&[file as u8][..], bytes].concat();
        folder.write_lengths(ending.trim_start_matches('_'), &input)?;
    }
    let replaced = |file: u8, from: &str, to: &str| {
        let (head, values) = files[usize::from(file)].1.split_at(128);
        let head = String::from_utf8_lossy(&head[10..]).replace(from, to);
        [
            &[file][..],
            b"\x93NUMPY\x01\0",
            &(head.len() as u16).to_le_bytes(),
            head.as_bytes(),
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
        ("beyond", 1, "(21,)", "(4611686018427387904,)"),
        ("no-shape", 1, "'shape'", "'form'"),
        ("record", 1, "'<f4'", "[('a', '<f4')]"),
    ] {
        folder.write(name, replaced(file, from, to))?;
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

/// Returns every 200th line of a set's first three files.
pub(crate) fn texts(material: &dyn Material) -> Result<Vec<String>, Box<dyn Error>> {
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

pub(crate) fn pab(folder: &Folder, texts: &[String]) -> SeedResult {
    folder.write_lengths("valid", texts.join("\0").as_bytes())?;
    folder.write("lacks-one", texts[..2].join("\0"))?;
    folder.write("twice", [&texts[0][..], &texts[0], &texts[1]].join("\0"))?;
    let single = texts[0]
        .replace("#set_intheta 0 10 20\n", "")
        .replace("#values", "#lines");
    for (name, from, to) in [
        ("alone", "", ""),
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
        folder.write(name, single.replace(from, to))?;
    }
    Ok(())
}

pub(crate) fn format(folder: &Folder, tensors: &[u8], text: &str) -> SeedResult {
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
        for reader in 0..6_u8 {
            folder.write(&format!("{name}-{reader}"), [&[reader][..], bytes].concat())?;
        }
    }
    Ok(())
}

pub(crate) fn fitted(folder: &Folder) -> SeedResult {
    for model in [ModelKind::Phong, ModelKind::CookTorrance, ModelKind::Neural] {
        let values = (0..model.parameters().unwrap_or_default())
            .map(|index| 0.1 + 0.01 * (index % 7) as f32);
        let fitted = FittedBrdf::new(model, values.collect(), None);
        let Some(material) = fitted.and_then(|fitted| FittedMaterial::new("seed".into(), fitted))
        else {
            return Err("the number of values is not that of the model".into());
        };
        let metadata = BTreeMap::from([("residual", 0.5)]);
        let text = material.to_json(None, metadata)?;
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
