//! SSDD and OpenMATERIAL: files written by hand.

use crate::angles;
use crate::folder::{Folder, load};

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
    // The BRDF grows with theta_h, and with phi_d up to a quarter turn.
    folder.write(
        "bands.ssdd",
        mono + "0 0\n1 1\n0 0\n1 1\n2 2\n3 3\n2 2\n3 3\n",
    );
    let bands = &load(&folder.at("bands.ssdd")).expect("the file is read")[0];
    assert_eq!([blue.name(), bands.name()], ["blue", "bands"]);
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

/// Returns a file of OpenMATERIAL with two wavelengths: 450 and 650 nm.
pub(crate) fn open_material(rows: &[[f64; 5]]) -> String {
    let table = serde_json::json!({
        "metadata": {"name": "bluish", "license": "MIT"},
        "brdf": {"wavelengths": [4.5e-7, 6.5e-7], "lookupTable": rows},
    });
    table.to_string()
}

/// The wavelengths of rows are in any order, and azimuths are of either sign.
#[test]
fn reads_rows_of_open_material_in_any_order() {
    let mut rows = Vec::new();
    for (wavelength, value) in [(6.5e-7, 0.1), (4.5e-7, 0.3)] {
        for [theta_i, theta_o] in (0..17 * 17).map(|index| [index / 17, index % 17]) {
            for phi in -12..=12 {
                let [theta_i, theta_o] = [theta_i, theta_o].map(|step| f64::from(step) * 0.09);
                let phi = f64::from(phi) * std::f64::consts::PI / 12.0;
                rows.push([wavelength, theta_i, theta_o, phi, value]);
            }
        }
    }
    let folder = Folder::new();
    let unknown = "[null,0,0,0,null],[4.5e-7,0,1.6,0,9]";
    let text =
        open_material(&rows).replace("\"lookupTable\":[", &format!("\"lookupTable\":[{unknown},"));
    let path = folder.write("file_brdf.xompt", text);
    let material = &load(&path).expect("the file is read")[0];
    assert_eq!(material.name(), "bluish");
    let [red, _, blue] = material.at_angles(angles([0.2, 0.5, 1.0]));
    assert!(red > 0.05 && blue > 1.5 * red && blue < 0.6, "{red} {blue}");
}
