//! Accuracy of written files, detection of formats, and files of SSDD and OpenMATERIAL that were written by hand.

use std::fs;

use clap::ValueEnum;
use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_materials::loss::loss_between;
use glimpse_materials::sampling::uniform_valid;
use glimpse_materials::{Brdf, Format, Material, Omission, Procedural, Tabulation, to_merl};

use crate::folder::{Folder, load};
use crate::rgl::{self, isotropic};
use crate::{FunctionMaterial, angles};

/// Returns the files of a BRDF in a format.
pub(crate) fn tabulated(format: Format, name: &str, brdf: &dyn Brdf) -> Vec<Vec<u8>> {
    let tabulate = format.properties().tabulate.expect("a table");
    tabulate(&Tabulation::rgb(name, brdf)).expect("the BRDF is finite")
}

#[test]
fn tensor_file_is_close_to_the_brdf() {
    let mut losses = Vec::new();
    for material in &Procedural::set(12, 5) {
        let read = rgl::read(&tabulated(Format::Rgl, "test", material)[0]);
        losses.push(loss_between(&*read, material));
        // The loss gives little weight to grazing outgoing directions, so that their error is checked separately.
        let (mut error, mut total) = (0.0, 0.0);
        for angles in uniform_valid(20_000, 6) {
            let at = HalfDifference::from_angles(angles);
            if !(0.01..0.1).contains(&at.cos_theta_o()) {
                continue;
            }
            let [expected, actual] = [material.at_angles(angles), read.at_angles(angles)];
            for (expected, actual) in expected.iter().zip(actual) {
                error += f64::from((actual - expected).abs());
                total += f64::from(*expected);
            }
        }
        assert!(
            error < 0.03 * total,
            "{}: {error} of {total}",
            material.name()
        );
    }
    let worst = losses.iter().copied().fold(0.0, f64::max);
    let mean = losses.iter().sum::<f64>() / losses.len() as f64;
    assert!(mean < 2e-4 && worst < 6e-4, "{mean}, {losses:?}");
}

#[test]
fn black_brdf_stays_black() {
    let black = FunctionMaterial(|_| [0.0; 3]);
    let read = rgl::read(&tabulated(Format::Rgl, "black", &black)[0]);
    assert_eq!(loss_between(&*read, &black), 0.0);
    let table = to_merl(&black).expect("the BRDF is finite");
    let values = table[12..].as_chunks().0.iter().copied();
    let mut values = values.map(f64::from_le_bytes);
    assert!(values.all(|value| [0.0, -1.0].contains(&value)));
}

#[test]
fn negative_values_are_written_as_0() {
    let material = &Procedural::set(1, 5)[0];
    let [negative, zero] = [f32::NEG_INFINITY, 0.0].map(|min| {
        FunctionMaterial(move |angles| material.at_angles(angles).map(|f| (f - 0.1).max(min)))
    });
    for format in Format::value_variants() {
        if format.properties().tabulate.is_some() {
            let [negative, zero] = [&negative, &zero].map(|brdf| tabulated(*format, "a", brdf));
            assert!(negative == zero, "{format:?}");
        }
    }
    // Neither does an RGL file have them below the horizon. Its last field is `rgb`.
    let file = &tabulated(Format::Rgl, "a", &negative)[0];
    let floats = file.rchunks_exact(4).take(66 * 3 * 96 * 96);
    let floats = floats.map(|bytes| f32::from_le_bytes(bytes.try_into().expect("4 bytes")));
    assert!(floats.fold(0.0, f32::min) == 0.0);
}

#[test]
fn rejects_non_finite_brdf() {
    let nan_material = FunctionMaterial(|angles: Angles<f32>| {
        [0.1, 0.1, if angles.theta_h > 0.5 { f32::NAN } else { 0.1 }]
    });
    let table = Tabulation::rgb("", &nan_material);
    for tabulate in Format::value_variants()
        .iter()
        .filter_map(|format| format.properties().tabulate)
    {
        let error = tabulate(&table).expect_err("the BRDF is NaN");
        let [theta_h, ..] = error.angles;
        assert!(
            error.value.is_nan() && theta_h > 0.5_f32.to_degrees(),
            "{error}"
        );
    }
}

#[test]
fn detects_format_from_content() {
    let folder = Folder::new();
    folder.write_table("table", &FunctionMaterial(|_| [0.1; 3]));
    folder.write("tensors", isotropic());
    for (file, names) in [
        ("table", ["a.binary", "b.bsdf", "c.table", "d"]),
        ("tensors", ["e.binary", "f.bsdf", "g.tensors", "h"]),
    ] {
        for name in names {
            fs::copy(folder.at(file), folder.at(name)).expect("the file is copied");
            let read = load(&folder.at(name)).expect("the file is read");
            let stem = name.trim_end_matches(".binary").trim_end_matches(".bsdf");
            assert_eq!(read[0].name(), stem);
        }
    }
    // In a directory, only files with a material's extension are read.
    let materials = load(folder.path()).expect("the directory is read");
    let names: Vec<&str> = materials.iter().map(|material| material.name()).collect();
    assert_eq!(names, ["a", "b", "e", "f"]);
}

/// A bluish diffuse BRDF.
pub(crate) const SSDD: &str = "VERSION 0.2\n\n# diffuse\nDATA_TYPE brdf\nCOLOR_MODEL rgb\n\
    PARAM_TYPE half_difference_coordinate_system\nREDUCTION_TYPE bilateral_symmetry reciprocity\n\
    PARAM0_LIST 0 90\nPARAM2_LIST 0 90\nPARAM3_LIST 0 90\nDATA ascii\n# PARAM3: 0\n";

#[test]
fn reads_tables_written_by_hand() {
    let folder = Folder::new();
    folder.write(
        "blue.ssdd",
        SSDD.to_owned() + &"0 0.0524275 0.159779\n".repeat(8),
    );
    let blue = &load(&folder.at("blue.ssdd")).expect("the file is read")[0];
    let mono = SSDD.replace("rgb", "spectrum\nWAVELENGTH_LIST 400 700");
    // The BRDF grows with theta_h, and with phi_d up to a quarter turn. Another block precedes it.
    let other = "DATA_TYPE specular_reflectance\nDATA ascii\n1\n\nDATA_TYPE brdf";
    folder.write(
        "bands.ssdd",
        mono.replace("DATA_TYPE brdf", other) + "0 0\n1 1\n0 0\n1 1\n2 2\n3 3\n2 2\n3 3\n",
    );
    let bands = &load(&folder.at("bands.ssdd")).expect("the file is read")[0];
    assert_eq!([blue.name(), bands.name()], ["blue", "bands"]);
    let omissions = vec![Omission::SpecularReflectance, Omission::Color];
    assert_eq!([blue.omissions(), bands.omissions()], [vec![], omissions]);
    for (theta_h, phi_d) in [(0.1, 0.3), (0.7, 1.4), (0.4, 3.0)] {
        let at = angles([theta_h, 0.3, phi_d]);
        let expected = [0.0, 0.052_427_5, 0.159_779];
        assert!(
            blue.at_angles(at)
                .iter()
                .zip(expected)
                .all(|(f, expected)| (f - expected).abs() < 1e-6)
        );
        let quarter: f64 = std::f64::consts::FRAC_PI_2;
        let expected =
            (theta_h / quarter + 2.0 * phi_d.min(2.0 * quarter - phi_d) / quarter) as f32;
        let brdf = bands.at_angles(at);
        assert!(
            brdf.iter().all(|f| (f / expected - 1.0).abs() < 0.03),
            "{brdf:?} {expected}"
        );
    }
}

/// Returns a file of OpenMATERIAL with three wavelengths: 450, 550 and 650 nm.
pub(crate) fn open_material(rows: &[[f64; 5]]) -> String {
    let table = serde_json::json!({
        "metadata": {"name": "bluish", "license": "MIT"},
        "brdf": {"wavelengths": [4.5e-7, 5.5e-7, 6.5e-7], "lookupTable": rows},
    });
    table.to_string()
}

/// The wavelengths of rows are in any order, and azimuths are of either sign.
#[test]
fn reads_rows_of_open_material_in_any_order() {
    let mut rows = Vec::new();
    for (wavelength, value) in [(6.5e-7, 0.1), (4.5e-7, 0.3), (5.5e-7, 0.2)] {
        rows.push([wavelength, 0.0, 1.6, 0.0, 9.0]);
        for [theta_i, theta_o] in (0..17 * 17).map(|index| [index / 17, index % 17]) {
            for phi in -12..=12 {
                let [theta_i, theta_o] = [theta_i, theta_o].map(|step| f64::from(step) * 0.09);
                let phi = f64::from(phi) * std::f64::consts::PI / 12.0;
                rows.push([wavelength, theta_i, theta_o, phi, value]);
            }
        }
    }
    let folder = Folder::new();
    let unknown = "[null,0,0,0,null]";
    let text =
        open_material(&rows).replace("\"lookupTable\":[", &format!("\"lookupTable\":[{unknown},"));
    let path = folder.write("file_brdf.xompt", text);
    let material = &load(&path).expect("the file is read")[0];
    assert_eq!(material.name(), "bluish");
    assert_eq!(material.omissions(), [Omission::Transmission]);
    let [red, _, blue] = material.at_angles(angles([0.2, 0.5, 1.0]));
    assert!(red > 0.05 && blue > 1.5 * red && blue < 0.6, "{red} {blue}");
}
