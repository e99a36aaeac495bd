//! Damaged and unsupported files: each is rejected with a message that names the file, the field and its value.

use std::collections::BTreeMap;

use glimpse_core::model::ModelKind;
use glimpse_materials::{FittedBrdf, FittedMaterial, to_nbrdf};

use crate::common::assert_names;
use crate::folder::{Folder, reported_defect};
use crate::formats::{SSDD, open_material};
use crate::network;
use crate::rgl;

/// Files of RGL, NBRDF, PAB-Opto and a fit of the model Phong.
const FILES: [&str; 4] = ["felt.bsdf", "felt_b2.npy", "felt.txt", "felt.json"];
/// A fit of the model Linear, without its basis.
const LINEAR: &str = "linear.json";

const PAB: &str = "#sample_name \"card\"\n#colorimetry: CIE-XYZ\n#format: theta phi BRDF\n#intheta 30\n\
                   #inphi 0\n#set_intheta 30\n#values 3\n0 0 0.1 0.11 0.12\n10 0 0.1 0.12 0.13\n\
                   10 90 0.13 0.14 0.15\n";

/// Returns the bytes of one of [`FILES`] or of [`LINEAR`]. All except the latter are valid.
fn bytes_of(name: &str) -> Vec<u8> {
    let fit = || {
        let fitted = FittedBrdf::new(ModelKind::Phong, vec![0.25; 7], None).expect("seven values");
        let fitted = FittedMaterial::new("felt".into(), fitted).expect("the values are finite");
        let json = fitted.to_json(None, BTreeMap::<&str, &str>::new());
        json.expect("the material is serialized")
    };
    match name {
        "felt.bsdf" => rgl::isotropic(),
        "felt_b2.npy" => to_nbrdf(network(1).parameters())[3].clone(),
        "felt.txt" => PAB.into(),
        "felt.json" => fit().into(),
        _ => {
            let basis = r#""basis": {"file": "none.basis", "checksum": "00000007"}"#;
            let text = fit().replace("\"basis\": null", basis);
            text.replace("phong", "linear").into()
        }
    }
}

/// Returns the defect that reading a file with these bytes reports, or None if it can be read.
fn defect(name: &str, bytes: &[u8]) -> Option<String> {
    let folder = Folder::new();
    if name.ends_with(".npy") {
        // A network consists of six files. The others are valid.
        folder.write_network("felt", &network(1));
    }
    let path = folder.write(name, bytes);
    reported_defect(&path, &path)
}

/// Asserts that a file is rejected, and that the message contains each of `words`, which are separated by spaces.
fn assert_rejected(name: &str, bytes: &[u8], words: &str) {
    let defect = defect(name, bytes);
    let defect = defect.unwrap_or_else(|| panic!("{name} is read: {words}"));
    assert_names(&defect, &words.split_whitespace().collect::<Vec<_>>());
}

/// Returns bytes with the first occurrence of a text replaced.
fn replaced(bytes: &[u8], from: &str, to: &str) -> Vec<u8> {
    let mut windows = bytes.windows(from.len());
    let at = windows.position(|window| window == from.as_bytes());
    let at = at.unwrap_or_else(|| panic!("no {from} in the file"));
    [&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat()
}

#[test]
fn truncated_and_extended_files_are_rejected_and_changed_ones_do_not_panic() {
    for name in FILES {
        let valid = &bytes_of(name)[..];
        assert_eq!(defect(name, valid), None, "{name}");
        // The line break at the end of JSON is optional.
        let optional = usize::from(name == "felt.json");
        for length in 0..valid.len() - optional {
            assert_rejected(name, &valid[..length], "");
        }
        for suffix in [&b"0"[..], b"0\n", &[0; 8]] {
            assert_rejected(name, &[valid, suffix].concat(), "");
        }
        let changes = (0..valid.len().min(600)).flat_map(|index| [1, 0x80].map(|bit| (index, bit)));
        let changed = changes.filter(|(index, bit)| {
            let mut other = valid.to_vec();
            other[*index] ^= bit;
            defect(name, &other).is_some()
        });
        assert!(changed.count() > 50, "{name}");
    }
}

#[test]
fn error_names_the_replaced_text() {
    let long = &"x".repeat(100_000)[..];
    let [_, array, text, json] = FILES;
    for (name, from, to, words) in [
        (array, "<f4", "<f8", "84 168"),
        (array, "<f4", "<i4", "<f4 descr <i4"),
        (array, "(21,)", "(7,3)", "(21,) 3)"),
        (array, "(21,)", "(22,)", "21 (22,)"),
        (array, "(21,)", "(((((", "((((("),
        (array, "NUMPY", "numpy", "NumPy"),
        (text, "CIE-XYZ", "spectral", "colorimetry spectral"),
        (text, "CIE-XYZ", long, "colorimetry"),
        (text, "phi BRDF", "phi BTDF", "format BTDF"),
        (text, "#format: theta phi BRDF\n", "", "#format"),
        (text, "#intheta 30\n", "", "#intheta"),
        (text, "#intheta 30", "#intheta inf", "intheta inf"),
        (text, "#intheta 30", "#intheta -30", "intheta -30"),
        (text, "10 90", "10 900", "10 900"),
        (text, "#inphi 0\n", "", "#inphi"),
        (text, "#values 3", "#values 4", "3 #values 4"),
        (text, "intheta 30\n#v", "intheta 30 60\n#v", "intheta 60"),
        (text, "0.1 0.11", "0,1 0,11", "8 0,1"),
        (text, "0.1 0.11", "inf NaN", "8 inf"),
        (text, "0.1 0.11 0.12", "0.1", "8 3"),
        (text, "card", "../card", "sample_name ../card"),
        (json, "{", "", "line 2"),
        (json, "glimpse-material", "m", "format m glimpse-material"),
        (json, ": 2,", ": 3, \"values\": {},", "version 3"),
        (
            json,
            ": 2,",
            ": 2, \"kernels\": {\"lengths\": [1, 1, 1], \"directions\": []},",
            "kernels basis",
        ),
        (json, "felt", "../felt", "name ../felt"),
        (json, "\"felt\"", "\" \"", "name"),
        (json, "felt", "\\u001b[2J", "name \\u{1b}[2J"),
        (json, "\"phong\"", "\"blinn\"", "model blinn"),
        (json, "phong", long, "model"),
        (json, "\"phong\"", "\"neural\"", "values 675 7"),
        (json, "\"phong\"", "\"linear\"", "basis"),
        (json, "0.25", "1e300", "values[0]"),
        (LINEAR, "none", "other", "other.basis"),
        (LINEAR, "00000007", "seven", "checksum seven"),
        #[cfg(unix)]
        (LINEAR, "none.basis", "/dev/zero", "/dev/zero"),
    ] {
        let bytes = replaced(&bytes_of(name), from, to);
        assert_rejected(name, &bytes, words);
    }
}

#[test]
fn error_names_the_defect_of_a_whole_file() {
    let header = |text: &str| replaced(&bytes_of("felt_b2.npy")[..128], "(21,), }        ", text);
    let mut not_a_number = bytes_of("felt_b2.npy");
    not_a_number[128 + 4 * 4..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    let no_values = &PAB[..PAB.len() - 58];
    let transmitted = no_values.to_owned() + &"99 0 1 1 1\n".repeat(3);
    let turned = PAB.replace("\n10 ", "\n1 ").replace("90", "1.6");
    let ssdd = |rows: &str| (SSDD.to_owned() + rows).into_bytes();
    let bands = |wavelengths: &[f64]| {
        let rows = wavelengths
            .iter()
            .map(|wavelength| [*wavelength, 0.1, 0.1, 0.0, 1.0]);
        open_material(&rows.collect::<Vec<_>>()).into_bytes()
    };
    let order = replaced(&ssdd(""), "PARAM0_LIST 0 90", "PARAM0_LIST 90 0");
    let radians = replaced(&ssdd(""), "PARAM2_LIST 0 90", "PARAM2_LIST 0 1.5708");
    let twice = replaced(&ssdd(""), "brdf", "brdf\nDATA_TYPE brdf");
    let degrees = open_material(&[[4.5e-7, 0.0, 45.0, 180.0, 1.0]]).into_bytes();
    let nm = replaced(&degrees, "[4.5e-7,5.5e-7", "[450,550");
    for (name, bytes, words) in [
        ("a.bsdf", &b"SCATFUN\x01\0\0\0\0"[..], "SCATFUN\\x01"),
        ("a.bsdf", b"GGX roughness=0.3\n", "roughness=0.3\\n"),
        ("a.bsdf", b"tensor", "tensor"),
        ("a.h5", b"\x89HDF\r\n\x1a\n", "\\x89HDF"),
        ("a.binary", b"\0\0\0\x5a\0\0\0\x5a\0\0\0\xb4", ""),
        ("a.json", b"{\"asset\": {}}", "format glimpse-material"),
        ("felt_b2.npy", &not_a_number, "[4] NaN"),
        // A header of 4 GiB, and 2^40 values. Neither is allocated.
        ("felt_b2.npy", b"\x93NUMPY\x02\x00\xff\xff\xff\xff{", ""),
        ("felt_b2.npy", &header("(1099511627776,)}"), ""),
        ("felt.txt", no_values.as_bytes(), "lines"),
        ("felt.txt", transmitted.as_bytes(), "transmission"),
        ("felt.txt", turned.as_bytes(), "degrees"),
        ("a.ssdd", &ssdd("0 0 0\n"), "1 8"),
        ("a.ssdd", &ssdd(&"0 0 0 0\n".repeat(8)), "4 3"),
        ("a.ssdd", &ssdd(&"0 x 0\n".repeat(8)), "0 x 0"),
        (
            "a.ssdd",
            &replaced(&ssdd(""), "brdf", "btdf"),
            "DATA_TYPE Transmission",
        ),
        ("a.ssdd", &order, "PARAM0_LIST"),
        ("a.ssdd", &radians, "PARAM2_LIST 1.5708 degrees"),
        ("a.ssdd", &twice, "DATA_TYPE brdf"),
        ("a_brdf.xompt", b"{}", "metadata line 1"),
        ("a_brdf.xompt", &degrees, "0 theta_o 45 180 radians"),
        ("a_brdf.xompt", &nm, "wavelengths m"),
        ("a_brdf.xompt", &bands(&[4.5e-7]), "1 3"),
        ("a_brdf.xompt", &bands(&[4.5e-7, 5e-7]), "5e-7 1"),
        ("a_brdf.xompt", &bands(&[4.5e-7, 4.5e-7]), "4.5e-7 1"),
    ] {
        assert_rejected(name, bytes, words);
    }
    for (bytes, words) in rgl::damaged() {
        assert_rejected("felt.bsdf", &bytes, &words);
    }
}
