//! `trainer fit`

use std::fs;

use glimpse_core::geometry::Angles;
use glimpse_core::recipe::Recipe;
use glimpse_materials::{Brdf, Procedural};
use serde_json::{Value, json};

use super::Folder;
use super::shared::LINEAR_N4;
use crate::common::assert_names;

/// A recipe of 16 samples that tolerates missing readings.
const MASKED: &str = "neural-n16.recipe";
/// A recipe of 8 samples that needs all readings.
const WHOLE: &str = "cook-torrance-n8.recipe";

/// A folder with both recipes.
fn folder() -> Folder {
    let folder = Folder::new();
    folder.add_bundled("masked/neural-n16.recipe");
    folder.add_bundled("paper/cook-torrance-n8.recipe");
    folder
}

fn material() -> Procedural {
    Procedural::new(1, 9)
}

fn pattern(folder: &Folder, recipe: &str) -> Vec<Angles<f32>> {
    let bytes = folder.read(recipe);
    let recipe = Recipe::parse(&bytes).expect("a valid recipe");
    recipe.pattern().collect()
}

/// Writes readings of samples in this order, each times a factor.
fn write_readings(folder: &Folder, file: &str, recipe: &str, samples: &[(usize, f32)]) {
    let pattern = pattern(folder, recipe);
    let rows = samples.iter().map(|(sample, factor)| {
        let angles = pattern[*sample];
        let [r, g, b] = material().at_angles(angles).map(|f| f * factor);
        let [theta_h, theta_d, phi_d] = angles.to_array().map(f32::to_degrees);
        format!("{g},{theta_d},{theta_h},{b},{r},{phi_d}\n")
    });
    let text = "g,theta_d,theta_h,b,r,phi_d\n".to_owned() + &rows.collect::<String>();
    folder.write(file, text);
}

/// The first samples, with factor 1.
fn first(count: usize) -> Vec<(usize, f32)> {
    (0..count).map(|sample| (sample, 1.0)).collect()
}

/// 16 samples without sample 3, in reverse order, with an optional outlier of factor 10.
fn shuffled(outlier: Option<usize>) -> Vec<(usize, f32)> {
    let all = (0..16).rev().filter(|sample| *sample != 3);
    let factor = |sample| match Some(sample) == outlier {
        true => 10.0,
        false => 1.0,
    };
    all.map(|sample| (sample, factor(sample))).collect()
}

#[test]
fn fits_readings_without_outlier() {
    let folder = folder();
    write_readings(&folder, "outlier.csv", MASKED, &shuffled(Some(1)));
    let mut without = shuffled(None);
    without.retain(|(sample, _)| *sample != 1);
    write_readings(&folder, "missing.csv", MASKED, &without);

    let fit = format!("fit {MASKED} --measurements");
    let report = folder.succeed_as_json(&format!("{fit} outlier.csv missing.csv --out fits"));
    for (field, expected) in [
        ("/0/name", json!("outlier")),
        ("/0/measured/rows", json!(15)),
        ("/0/measured/file", json!("outlier.csv")),
        ("/0/recipe/file", json!(MASKED)),
        (
            "/0/readings/unused",
            json!([{ "sample": 1, "status": "outlier" }, { "sample": 3, "status": "missing" }]),
        ),
        ("/0/readings/outliers/0/sample", json!(1)),
        ("/0/readings/outliers/0/status", json!("outlier")),
        ("/0/readings/used", json!(14)),
        ("/1/name", json!("missing")),
        ("/1/readings/unused/0/status", json!("missing")),
    ] {
        assert_eq!(report.pointer(field), Some(&expected), "{field}");
    }
    assert!(report[0]["expected_loss"]["loss"].is_number(), "{report}");
    assert_eq!(folder.names("fits"), ["missing", "outlier"]);
    let files = ["lobe.svg", "material.json", "readings.csv", "sphere.png"];
    assert_eq!(folder.names("fits/outlier"), files);
    // A fit without the outlier equals a fit with that reading missing.
    let values = |of: &str| folder.read_json(&format!("{of}/material.json"))["values"].clone();
    assert_eq!(values("fits/outlier"), values("fits/missing"));
    let readings = folder.read_text("fits/outlier/readings.csv");
    let rows = readings.lines().skip(1);
    let statuses: Vec<&str> = rows
        .map(|row| row.rsplit(',').next().unwrap_or_default())
        .collect();
    assert_eq!(
        (statuses.len(), statuses[1], statuses[3], statuses[0]),
        (16, "outlier", "missing", "used")
    );

    // readings.csv can be fitted again, and the folder is a source of materials.
    folder.succeed(&format!("{fit} fits/missing/readings.csv --out again"));
    assert_eq!(values("again"), values("fits/missing"));
    let brdf = folder.succeed("query fits --angles missing.csv");
    assert_eq!(brdf.lines().count(), 1 + 2 * 14, "{brdf}");
    folder.succeed("render sphere fits --size 16 --out s.png");

    // --keep-all uses the outlier, which the report names.
    let text = folder.succeed(&format!("{fit} outlier.csv --keep-all --out kept"));
    assert_names(&text, &["outlier.csv", "15", "16", "1", "3"]);
}

#[test]
fn rejects_missing_readings() {
    let folder = folder();
    let some = [7, 1, 2, 4, 5, 6].map(|sample| (sample, 1.0));
    write_readings(&folder, "some.csv", WHOLE, &some);
    folder.fail_naming(
        &format!("fit {WHOLE} --measurements some.csv --out out"),
        &["some.csv", "0", "3", "8", "--missing"],
    );
    assert!(!folder.exists("out"));

    let mut all = first(8);
    all[0].1 = 30.0;
    write_readings(&folder, "all.csv", WHOLE, &all);
    let fit = format!("fit {WHOLE} --measurements all.csv --out out");
    let report = folder.succeed_as_json(&fit);
    let readings = &report[0]["readings"];
    assert_eq!(readings["outliers"][0]["sample"], 0);
    assert_eq!(
        (&readings["used"], &readings["unused"]),
        (&json!(8), &json!([]))
    );
}

#[test]
fn checks_quantity_and_material_columns() {
    let folder = folder();
    let fit = format!("fit {MASKED} --out out --measurements");
    write_readings(&folder, "read.csv", MASKED, &shuffled(None));
    folder.succeed(&format!("fit {MASKED} --measurements read.csv --out first"));

    // `readings.csv` holds BRDFs, which must not be converted again.
    folder.write("brdf.csv", folder.read("first/readings.csv"));
    // The column accepts the quantity of the options, by either of its names.
    folder.write(
        "cosine.csv",
        "index,value,quantity\n0,1,BRDF-cos\n1,1,brdf-cos-o\n2,1,\n3,1,brdf\n",
    );
    // A file must have a single material.
    folder.write("two.csv", "material,index,value\ngold,0,1\nfelt,0,0.1\n");
    // Light and sensor are exchanged.
    let angles = pattern(&folder, MASKED)[2];
    let [theta_h, theta_d, phi_d] = angles.to_array().map(f32::to_degrees);
    let exchanged = phi_d + 180.0;
    folder.write(
        "swapped.csv",
        format!("theta_h,theta_d,phi_d,value\n{theta_h},{theta_d},{exchanged},0.1\n"),
    );
    folder.fail_each(
        &fit,
        &[
            "brdf.csv --quantity reflectance-factor => brdf.csv 2 quantity brdf reflectance-factor",
            "read.csv --white brdf.csv => brdf.csv 2 quantity counts",
            "cosine.csv --quantity brdf-cos => cosine.csv 5 quantity brdf brdf-cos-o",
            "two.csv => two.csv 3 material felt gold",
            "swapped.csv => swapped.csv 2 exchanged",
        ],
    );
    assert!(!folder.exists("out"));
}

/// The readings of a dead sensor look like a black material, for which no loss is expected.
#[test]
fn reports_readings_without_light() {
    let folder = folder();
    for dark in [8, 3] {
        let mut all = first(8);
        all[..dark]
            .iter_mut()
            .for_each(|(_, factor)| *factor = -0.0);
        write_readings(&folder, "dark.csv", WHOLE, &all);
        let fit = format!("fit {WHOLE} --measurements dark.csv --out {dark}");
        if dark == 8 {
            folder.fail_naming(&fit, &["dark.csv", "--accept-implausible"]);
            assert!(!folder.exists("8"));
        }
        let report = folder.succeed_as_json(&format!("{fit} --accept-implausible"));
        let no_light: Vec<usize> = (0..dark).collect();
        assert_eq!(report[0]["readings"]["no_light"], json!(no_light));
        let is_known = report[0]["expected_loss"].is_object();
        assert_eq!(is_known, dark == 3, "{report}");
    }
}

#[test]
fn replaces_results_only_with_force() {
    let folder = folder();
    write_readings(&folder, "a.csv", MASKED, &shuffled(None));
    let fit = format!("fit {MASKED} --measurements a.csv --out out");
    folder.succeed(&fit);
    folder.fail_naming(&fit, &["out/material.json", "--force"]);
    folder.succeed(&format!("{fit} --force"));

    // Inputs are not overwritten, and parent folders are not created.
    let text = folder.read("a.csv");
    folder.write("readings.csv", &text);
    fs::create_dir(folder.at("b")).expect("the folder is created");
    folder.write("b/a.csv", &text);
    folder.fail_each(
        &format!("fit {MASKED} --measurements"),
        &[
            "readings.csv --out . --force => readings.csv",
            "a.csv --out none/deeper => none",
            "a.csv b/a.csv --out two => --measurements a",
        ],
    );
    assert_eq!(folder.read("readings.csv"), text);
    assert!(!folder.exists("none") && !folder.exists("two"));
}

#[test]
fn linear_fit_includes_basis() {
    let folder = Folder::new();
    LINEAR_N4.copy_to(folder.path());
    let (recipe, basis) = ("linear-n4.recipe", "linear-n4.basis");
    for file in ["a.csv", "b.csv"] {
        write_readings(&folder, file, recipe, &first(4));
    }
    folder.succeed(&format!("fit {recipe} --measurements a.csv --out one"));
    folder.succeed(&format!(
        "fit {recipe} --measurements a.csv b.csv --out two"
    ));
    // Both folders can be moved, and have the same BRDF.
    fs::rename(folder.at("two/b"), folder.at("moved")).expect("the folder is moved");
    fs::remove_file(folder.at(basis)).expect("the file is removed");
    let one = "query one --angles a.csv";
    assert_eq!(
        folder.succeed(one),
        folder.succeed("query moved --angles a.csv")
    );
    fs::remove_file(folder.at("one/material.basis")).expect("the file is removed");
    folder.fail_naming(one, &["material.basis"]);
}

/// Files for other programs are in a subfolder, so that the folder remains a source of one material.
#[test]
fn writes_other_formats() {
    let folder = folder();
    write_readings(&folder, "a.csv", MASKED, &shuffled(None));
    let fit = format!("fit {MASKED} --measurements a.csv --format nbrdf,rgl --out fits");
    folder.succeed(&fit);
    let arrays = ["b1", "b2", "b3", "fc1", "fc2", "fc3"];
    let mut expected = arrays.map(|array| format!("a_{array}.npy")).to_vec();
    expected.push("a_rgb.bsdf".to_owned());
    assert_eq!(folder.names("fits/formats"), expected);
    // A fitted network is written with its exact weights.
    folder.succeed("convert fits again --format nbrdf");
    for array in arrays {
        assert_eq!(
            folder.read(&format!("again_{array}.npy")),
            folder.read(&format!("fits/formats/a_{array}.npy"))
        );
    }
    folder.fail_naming(&format!("{fit} --force"), &["fits/formats"]);
}

#[test]
fn material_json_has_report_fields() {
    let folder = folder();
    write_readings(&folder, "a.csv", MASKED, &shuffled(Some(1)));
    folder.succeed(&format!("fit {MASKED} --measurements a.csv --out masked"));
    let material_json = folder.read_json("masked/material.json");
    let bytes = folder.read(MASKED);
    let recipe = Recipe::parse(&bytes).expect("a valid recipe");
    for (field, expected) in [
        ("/format", json!("glimpse-material")),
        ("/version", json!(2)),
        ("/model", json!("neural")),
        ("/quantity", json!("brdf")),
        ("/unit", json!("sr^-1")),
        ("/times_cosine", json!(false)),
        ("/color_space", json!("linear-rgb")),
        ("/recipe/model", json!("neural")),
        ("/recipe/samples", json!(16)),
        (
            "/recipe/checksum",
            json!(format!("{:08x}", recipe.checksum())),
        ),
        ("/measured/quantity", json!("brdf")),
        ("/readings/used", json!(14)),
        ("/recipe/off_pattern", json!(false)),
    ] {
        assert_eq!(material_json.pointer(field), Some(&expected), "{field}");
    }
    let trainer = material_json["trainer"].as_str().expect("a version");
    assert!(trainer.starts_with(env!("CARGO_PKG_VERSION")), "{trainer}");
    for field in ["/residual/mean", "/residual/worst", "/expected_loss/loss"] {
        assert!(
            material_json.pointer(field).is_some_and(Value::is_number),
            "{field}"
        );
    }
}
