//! Accuracy of written files, and detection of formats.

use std::fs;

use glimpse_core::geometry::{Angles, HalfDifference};
use glimpse_materials::loss::loss_between;
use glimpse_materials::sampling::uniform_valid;
use glimpse_materials::{Brdf, Format, Material, Procedural, Tabulation, to_merl};

use crate::FunctionMaterial;
use crate::folder::{Folder, load};
use crate::rgl::{self, isotropic};

/// Returns the files of a BRDF in a format.
pub(crate) fn tabulated(format: Format, name: &str, brdf: &dyn Brdf) -> Vec<Vec<u8>> {
    let tabulate = format.tabulate().expect("a table");
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
fn rejects_non_finite_brdf() {
    let nan_material = FunctionMaterial(|angles: Angles<f32>| {
        [0.1, 0.1, if angles.theta_h > 0.5 { f32::NAN } else { 0.1 }]
    });
    let table = Tabulation::rgb("", &nan_material);
    for tabulate in Format::ALL.into_iter().filter_map(Format::tabulate) {
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
