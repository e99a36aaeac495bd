//! SSDD and OpenMATERIAL: files written by hand, and damaged ones.

use glimpse_materials::Source;

use crate::angles;
use crate::folder::{Folder, load};

/// A bluish diffuse BRDF.
const SSDD: &str = "VERSION 0.2\n\n# diffuse\nDATA_TYPE brdf\nCOLOR_MODEL rgb\n\
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

    let rows: Vec<String> = [4.5e-7, 6.5e-7]
        .iter()
        .flat_map(|wavelength| {
            let polar = (0..=16).flat_map(|i| (0..=16).map(move |o| (i, o)));
            polar.flat_map(move |(i, o)| {
                let radians = |step: i32| f64::from(step) * 0.09;
                (0..25).map(move |phi| {
                    let phi = f64::from(phi) * 0.25;
                    format!("[{wavelength:e},{},{},{phi},0.2]", radians(i), radians(o))
                })
            })
        })
        .collect();
    let table = |rows: &str| {
        format!(
            r#"{{"metadata": {{"name": "gray", "license": "MIT"}},
                "brdf": {{"wavelengths": [4.5e-7, 6.5e-7], "lookupTable": [{rows}]}}}}"#
        )
    };
    folder.write(
        "gray_brdf.xompt",
        table(&(rows.join(",") + ",[null,0,0,0,null]")),
    );
    let gray = &load(&folder.at("gray_brdf.xompt")).expect("the file is read")[0];
    assert_eq!(gray.name(), "gray");
    let brdf = gray.at_angles(angles([0.2, 0.5, 1.0]));
    assert!(
        brdf.iter().all(|f| (f / 0.2 - 1.0).abs() < 0.02),
        "{brdf:?}"
    );

    for (name, text) in [
        ("short.ssdd", SSDD.to_owned() + "0 0 0\n"),
        ("wide.ssdd", SSDD.to_owned() + &"0 0 0 0\n".repeat(8)),
        ("word.ssdd", SSDD.to_owned() + &"0 x 0\n".repeat(8)),
        ("btdf.ssdd", SSDD.replace("brdf", "btdf")),
        (
            "order.ssdd",
            SSDD.replace("PARAM0_LIST 0 90", "PARAM0_LIST 90 0"),
        ),
        ("lacks_brdf.xompt", table(&rows[..rows.len() - 1].join(","))),
        ("text_brdf.xompt", "{}".to_owned()),
    ] {
        folder.write(name, text);
        let error = Source(folder.at(name).display().to_string()).load().err();
        let message = error.expect("the file is damaged").to_string();
        assert!(message.contains(name), "{message}");
    }
}
