//! `trainer fit`

use std::fs;
use std::path::Path;

use glimpse_core::geometry::Angles;
use glimpse_core::recipe::Recipe;
use glimpse_materials::basis::widened;
use glimpse_materials::{Material, Procedural};
use glimpse_trainer::measurement::Arms;
use serde_json::{Value, json};

use super::common::assert_names;
use super::shared::LINEAR_N4;
use super::{fail, fail_naming, succeed, succeed_as_json};

const MASKED: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/recipes/masked/neural-n16.recipe"
);
const WHOLE: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/recipes/cook-torrance-n8.recipe"
);

fn material() -> Procedural {
    Procedural::new(1, 9)
}

fn pattern(recipe: &Path) -> Vec<Angles<f32>> {
    let bytes = fs::read(recipe).expect("the recipe is there");
    let recipe = Recipe::parse(&bytes).expect("it is a recipe");
    recipe.pattern().collect()
}

/// The readings of some samples, each times a number, in this order.
fn csv(recipe: &Path, samples: &[(usize, f32)]) -> String {
    let pattern = pattern(recipe);
    let rows = samples.iter().map(|(sample, factor)| {
        let angles = pattern[*sample];
        let [r, g, b] = material().brdf(angles).map(|f| f * factor);
        let [theta_h, theta_d, phi_d] =
            [angles.theta_h, angles.theta_d, angles.phi_d].map(f32::to_degrees);
        format!("{g},{theta_d},{theta_h},{b},{r},{phi_d}\n")
    });
    "g,theta_d,theta_h,b,r,phi_d\n".to_owned() + &rows.collect::<String>()
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("it can be listed");
    let names = entries.map(|entry| entry.expect("an entry").file_name());
    let mut names: Vec<String> = names
        .map(|name| name.to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("it is JSON")
}

/// All but the third sample, from the last to the first.
fn shuffled(wrong: Option<usize>) -> Vec<(usize, f32)> {
    let all = (0..16).rev().filter(|sample| *sample != 3);
    let factor = |sample| match Some(sample) == wrong {
        true => 10.0,
        false => 1.0,
    };
    all.map(|sample| (sample, factor(sample))).collect()
}

#[test]
fn readings_are_matched_looked_at_and_fitted() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let masked = Path::new(MASKED);
    fs::write(directory.join("wrong.csv"), csv(masked, &shuffled(Some(1)))).expect("written");
    let without: Vec<_> = shuffled(None)
        .into_iter()
        .filter(|(s, _)| *s != 1)
        .collect();
    fs::write(directory.join("right.csv"), csv(masked, &without)).expect("written");

    let fit = [
        "fit",
        MASKED,
        "--measurements",
        "wrong.csv",
        "right.csv",
        "--out",
        "fits",
    ];
    let report = succeed_as_json(directory, &[&fit[..], &["--json"]].concat());
    let [wrong, right] = [0, 1].map(|index| &report[index]);
    assert_eq!(
        (&wrong["name"], &right["name"]),
        (&json!("wrong"), &json!("right"))
    );
    assert_eq!(wrong["measured"]["rows"], 15);
    assert_eq!(wrong["measured"]["file"], "wrong.csv");
    assert_eq!(wrong["recipe"]["file"], "neural-n16.recipe");
    assert_eq!(wrong["recipe"]["samples"], 16);
    assert_eq!(wrong["readings"]["missing"], json!([3]));
    assert_eq!(wrong["readings"]["looks_wrong"][0]["sample"], 1);
    assert_eq!(wrong["readings"]["left_out"], json!([1]));
    assert_eq!(wrong["readings"]["used"], 14);
    assert!(wrong["expected_loss"]["loss"].is_number(), "{wrong}");
    assert_eq!(right["measured"]["rows"], 14);
    assert_eq!(right["readings"]["missing"], json!([1, 3]));
    let files = ["lobe.svg", "material.json", "readings.csv", "sphere.png"];
    assert_eq!(names(&directory.join("fits")), ["right", "wrong"]);
    assert_eq!(names(&directory.join("fits/wrong")), files);
    // What was left out is as good as missing.
    let values = |name: &str| {
        let path = directory.join("fits").join(name).join("material.json");
        json(&fs::read_to_string(path).expect("it is there"))["values"].clone()
    };
    assert_eq!(values("wrong"), values("right"));
    let readings = fs::read_to_string(directory.join("fits/wrong/readings.csv")).expect("there");
    let fates: Vec<&str> = readings
        .lines()
        .skip(1)
        .map(|line| line.rsplit(',').next().unwrap_or_default())
        .collect();
    assert_eq!(
        (fates.len(), fates[1], fates[3], fates[0]),
        (16, "left out", "missing", "used")
    );

    // A table of readings can be measured by again, and a fit is a material.
    let again = [
        "fit",
        MASKED,
        "--measurements",
        "fits/right/readings.csv",
        "--out",
        "again",
    ];
    succeed(directory, &again);
    let json_of = |path: &str| json(&fs::read_to_string(directory.join(path)).expect("there"));
    assert_eq!(json_of("again/material.json")["values"], values("right"));
    let query = ["query", "fits", "--angles", "right.csv"];
    let found = succeed(directory, &query);
    assert_eq!(found.lines().count(), 1 + 2 * 14, "{found}");
    succeed(
        directory,
        &["render", "sphere", "fits", "--size", "16", "--out", "s.png"],
    );

    // All are kept if that is asked for, and it is said.
    let kept = [
        "fit",
        MASKED,
        "--measurements",
        "wrong.csv",
        "--keep-all",
        "--out",
        "kept",
    ];
    let text = succeed(directory, &kept);
    assert_names(&text, &["wrong.csv", "--keep-all", "15", "16", "1", "3"]);
}

#[test]
fn a_recipe_that_needs_all_readings_says_so() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let whole = Path::new(WHOLE);
    let some: Vec<(usize, f32)> =
        [(7, 1.0), (1, 1.0), (2, 1.0), (4, 1.0), (5, 1.0), (6, 1.0)].into();
    fs::write(directory.join("some.csv"), csv(whole, &some)).expect("written");
    fail_naming(
        directory,
        &["fit", WHOLE, "--measurements", "some.csv", "--out", "out"],
        &["some.csv", "0", "3", "8", "--missing"],
    );
    assert!(!directory.join("out").exists());

    let all: Vec<(usize, f32)> = (0..8)
        .map(|s| (s, if s == 0 { 30.0 } else { 1.0 }))
        .collect();
    fs::write(directory.join("all.csv"), csv(whole, &all)).expect("written");
    let fit = ["fit", WHOLE, "--measurements", "all.csv", "--out", "out"];
    let report = succeed_as_json(directory, &[&fit[..], &["--json"]].concat());
    let readings = &report[0]["readings"];
    assert_eq!(readings["looks_wrong"][0]["sample"], 0);
    assert_eq!(
        (&readings["used"], &readings["left_out"]),
        (&json!(8), &json!([]))
    );
}

/// A dead sensor reads as a black material, of which no good fit may be promised.
#[test]
fn what_a_file_says_of_itself_holds() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let fit = |file: &'static str| ["fit", MASKED, "--measurements", file, "--out", "out"];
    let masked = Path::new(MASKED);
    fs::write(directory.join("read.csv"), csv(masked, &shuffled(None))).expect("written");
    succeed(
        directory,
        &[
            "fit",
            MASKED,
            "--measurements",
            "read.csv",
            "--out",
            "first",
        ],
    );

    // Neither is lost to a command that writes something else.
    let query = ["query", "procedural:1", "--angles", "read.csv", "--out"];
    let export = ["export", MASKED, "--format", "json", "--out"];
    for (command, file) in [
        (&query[..], "first/readings.csv"),
        (&export[..], "first/material.json"),
    ] {
        let before = fs::read(directory.join(file)).expect("it is there");
        fail_naming(directory, &[command, &[file]].concat(), &[file]);
        assert_eq!(fs::read(directory.join(file)).expect("there"), before);
    }

    // What was read became BRDFs, and they are not made BRDFs once more.
    fs::copy(
        directory.join("first/readings.csv"),
        directory.join("brdf.csv"),
    )
    .expect("copied");
    let factor = [&fit("brdf.csv")[..], &["--quantity", "reflectance-factor"]].concat();
    fail_naming(
        directory,
        &factor,
        &["brdf.csv", "2", "quantity", "brdf", "reflectance-factor"],
    );
    let counts = [&fit("read.csv")[..], &["--white", "brdf.csv"]].concat();
    fail_naming(directory, &counts, &["brdf.csv", "2", "quantity", "counts"]);
    assert!(!directory.join("out").exists());

    // A quantity that is the options' own is none but that, by either of its names.
    fs::write(
        directory.join("cosine.csv"),
        "index,value,quantity\n0,1,BRDF-cos\n1,1,brdf-cos-o\n2,1,\n3,1,brdf\n",
    )
    .expect("written");
    let cosine = [&fit("cosine.csv")[..], &["--quantity", "brdf-cos"]].concat();
    fail_naming(
        directory,
        &cosine,
        &["cosine.csv", "5", "quantity", "brdf", "brdf-cos-o"],
    );

    // A file is of one material.
    fs::write(
        directory.join("two.csv"),
        "material,index,value\ngold,0,1\nfelt,0,0.1\n",
    )
    .expect("written");
    fail_naming(
        directory,
        &fit("two.csv"),
        &["two.csv", "3", "material", "felt", "gold"],
    );

    // Light and sensor exchanged, and nothing that says so.
    let angles = pattern(masked)[2];
    let degrees = |angle: f32| angle.to_degrees();
    let [theta_h, theta_d, phi_d] = [
        degrees(angles.theta_h),
        degrees(angles.theta_d),
        degrees(angles.phi_d) + 180.0,
    ];
    fs::write(
        directory.join("swapped.csv"),
        format!("theta_h,theta_d,phi_d,value\n{theta_h},{theta_d},{phi_d},0.1\n"),
    )
    .expect("written");
    fail_naming(
        directory,
        &fit("swapped.csv"),
        &["swapped.csv", "2", "--swap", "index"],
    );
}

#[test]
fn readings_without_light_are_named() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let whole = Path::new(WHOLE);
    for dark in [8, 3] {
        let all: Vec<(usize, f32)> = (0..8)
            .map(|sample| (sample, if sample < dark { -0.0 } else { 1.0 }))
            .collect();
        fs::write(directory.join("dark.csv"), csv(whole, &all)).expect("written");
        let fit = ["fit", WHOLE, "--measurements", "dark.csv", "--out"];
        let out = dark.to_string();
        let fit = [&fit[..], &[&out, "--json"]].concat();
        let report = succeed_as_json(directory, &fit);
        let no_light: Vec<usize> = (0..dark).collect();
        assert_eq!(report[0]["readings"]["no_light"], json!(no_light));
        // Of a black material no loss is promised.
        let is_known = report[0]["expected_loss"].is_object();
        assert_eq!(is_known, dark == 3, "{report}");
    }
}

#[test]
fn nothing_is_written_over_unless_it_is_forced() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let masked = Path::new(MASKED);
    let text = csv(masked, &shuffled(None));
    fs::write(directory.join("a.csv"), &text).expect("written");
    let fit = ["fit", MASKED, "--measurements", "a.csv", "--out", "out"];
    succeed(directory, &fit);
    fail_naming(directory, &fit, &["out/material.json", "--force"]);
    succeed(directory, &[&fit[..], &["--force"]].concat());

    // Not what is read, and no folder above the one that is named.
    fs::write(directory.join("readings.csv"), &text).expect("written");
    let here = [
        "fit",
        MASKED,
        "--measurements",
        "readings.csv",
        "--out",
        ".",
        "--force",
    ];
    fail_naming(directory, &here, &["readings.csv"]);
    assert_eq!(
        fs::read_to_string(directory.join("readings.csv")).expect("there"),
        text
    );
    let deep = [
        "fit",
        MASKED,
        "--measurements",
        "a.csv",
        "--out",
        "none/deeper",
    ];
    fail_naming(directory, &deep, &["none"]);
    assert!(!directory.join("none").exists());
    fs::create_dir(directory.join("b")).expect("it is made");
    fs::copy(directory.join("a.csv"), directory.join("b/a.csv")).expect("copied");
    let twice = [
        "fit",
        MASKED,
        "--measurements",
        "a.csv",
        "b/a.csv",
        "--out",
        "two",
    ];
    fail_naming(directory, &twice, &["--measurements", "a"]);
    assert!(!directory.join("two").exists());
}

#[test]
fn an_option_without_effect_is_refused() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    for (arguments, named) in [
        (&[][..], &["--measurements", "--values"][..]),
        (
            &["--measurements", "a.csv", "--values", "b.json"],
            &["--measurements"],
        ),
        (
            &["--measurements", "a.csv", "--dark", "9"],
            &["--dark", "--white"],
        ),
        (
            &["--measurements", "a.csv", "--footprint", "light"],
            &["--footprint"],
        ),
        (
            &[
                "--measurements",
                "a.csv",
                "--white",
                "w.csv",
                "--quantity",
                "brdf",
            ],
            &["--quantity", "--white"],
        ),
        (
            &["--values", "b.json", "--keep-all"],
            &["--keep-all", "--values"],
        ),
        (
            &["--values", "b.json", "--quantity", "brdf-cos"],
            &["--quantity", "--values"],
        ),
        (
            &["--values", "b.json", "--tolerance", "1"],
            &["--tolerance", "--values"],
        ),
        (
            &["--values", "b.json", "--white", "w.csv"],
            &["--white", "--values"],
        ),
        (
            &["--values", "b.json", "--dark", "9"],
            &["--dark", "--values"],
        ),
        (
            &["--values", "b.json", "--white-reflectance", "0.9"],
            &["--white-reflectance", "--values"],
        ),
        (
            &["--values", "b.json", "--saturation", "4095"],
            &["--saturation", "--values"],
        ),
        (
            &["--values", "b.json", "--footprint", "light"],
            &["--footprint", "--values"],
        ),
    ] {
        let all = [&["fit", MASKED, "--out", "out"], arguments].concat();
        fail_naming(scratch.path(), &all, named);
    }
    assert!(!scratch.path().join("out").exists());
}

#[test]
fn what_a_device_has_found_becomes_the_same_folder() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let masked = Path::new(MASKED);
    fs::write(directory.join("a.csv"), csv(masked, &shuffled(None))).expect("written");
    succeed(
        directory,
        &["fit", MASKED, "--measurements", "a.csv", "--out", "lab"],
    );
    let json_of = |folder: &str| {
        let path = directory.join(folder).join("material.json");
        json(&fs::read_to_string(path).expect("it is there"))
    };
    let lab = json_of("lab");
    let pattern = pattern(masked);
    let readings: Vec<Value> = pattern
        .iter()
        .map(|angles| {
            json!({
                "theta_h": angles.theta_h,
                "theta_d": angles.theta_d,
                "phi_d": angles.phi_d,
                "brdf": material().brdf(*angles),
                "saturated": false,
            })
        })
        .collect();
    let mut sent = json!({
        "model": "neural",
        "recipe": lab["recipe"]["checksum"],
        "values": lab["values"],
        "readings": readings,
    });
    let write = |sent: &Value| fs::write(directory.join("scan.json"), sent.to_string());
    write(&sent).expect("written");
    let values = ["fit", MASKED, "--values", "scan.json", "--out", "device"];
    let text = succeed(directory, &values);
    assert_names(&text, &["16"]);
    assert_ne!(json_of("device")["expected_loss"], Value::Null);
    assert_eq!(
        names(&directory.join("device")),
        names(&directory.join("lab"))
    );
    assert_eq!(json_of("device")["values"], lab["values"]);

    for (field, value, named) in [
        ("recipe", json!("00000000"), "00000000"),
        ("values", json!([1.0]), "1"),
    ] {
        sent = json!({ "model": "neural", "recipe": lab["recipe"]["checksum"], "values": [] });
        sent[field] = value;
        write(&sent).expect("written");
        let other = [&values[..4], &["--out", "other"]].concat();
        fail_naming(directory, &other, &["scan.json", named]);
    }
}

#[test]
fn a_fit_of_linear_has_its_basis_beside_it() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    LINEAR_N4.copy_to(directory);
    let (recipe, basis) = ("linear-n4.recipe", "linear-n4.basis");
    let all: Vec<(usize, f32)> = (0..4).map(|sample| (sample, 1.0)).collect();
    let text = csv(&directory.join(recipe), &all);
    fs::write(directory.join("a.csv"), &text).expect("written");
    fs::write(directory.join("b.csv"), &text).expect("written");
    succeed(
        directory,
        &["fit", recipe, "--measurements", "a.csv", "--out", "one"],
    );
    let two = [
        "fit",
        recipe,
        "--measurements",
        "a.csv",
        "b.csv",
        "--out",
        "two",
    ];
    succeed(directory, &two);
    assert_eq!(names(&directory.join("two")), ["a", "b", basis]);
    // Both can be moved, and say the same.
    fs::rename(directory.join("two"), directory.join("moved")).expect("it is moved");
    fs::remove_file(directory.join(basis)).expect("it is removed");
    let query = |source| succeed(directory, &["query", source, "--angles", "a.csv"]);
    assert_eq!(query("one"), query("moved/b"));
    fs::remove_file(directory.join("one").join(basis)).expect("it is removed");
    fail_naming(directory, &["query", "one", "--angles", "a.csv"], &[basis]);
}

/// What another program reads stands in a folder of its own, so that the fit is one material still.
#[test]
fn a_fit_goes_out_in_other_formats() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    fs::write(
        directory.join("a.csv"),
        csv(Path::new(MASKED), &shuffled(None)),
    )
    .expect("written");
    let fit = [
        "fit",
        MASKED,
        "--measurements",
        "a.csv",
        "--format",
        "nbrdf,rgl",
        "--out",
        "fits",
    ];
    succeed(directory, &fit);
    let formats = directory.join("fits/formats");
    let mut expected: Vec<String> = ["b1", "b2", "b3", "fc1", "fc2", "fc3"]
        .map(|name| format!("a_{name}.npy"))
        .to_vec();
    expected.push("a_rgb.bsdf".to_owned());
    assert_eq!(names(&formats), expected);
    // A network that was fitted is written to the bit.
    succeed(
        directory,
        &["convert", "fits", "again", "--format", "nbrdf"],
    );
    for name in ["fc1", "b1", "fc2", "b2", "fc3", "b3"] {
        let read = |path: &Path| fs::read(path).expect("it is there");
        assert_eq!(
            read(&directory.join(format!("again_{name}.npy"))),
            read(&formats.join(format!("a_{name}.npy")))
        );
    }
    let again = fail(directory, &[&fit[..], &["--force"]].concat());
    assert_names(&again, &["fits/formats"]);
}

/// Rows at a recipe's samples, whose azimuths are counted by a sign.
fn at_directions(recipe: &Path, sign: f64, is_named: bool) -> String {
    let places = pattern(recipe).into_iter().enumerate();
    let rows = places.map(|(sample, angles)| {
        let arms = Arms::of(widened(&angles));
        let [r, g, b] = material().brdf(angles);
        let [theta_i, theta_o, phi] =
            [arms.theta_i, arms.theta_o, sign * arms.phi].map(f64::to_degrees);
        let name = if is_named {
            format!("{sample}")
        } else {
            String::new()
        };
        format!("{name},{theta_i},10,{theta_o},{},{r},{g},{b}\n", phi + 10.0)
    });
    "index,theta_i,phi_i,theta_o,phi_o,r,g,b\n".to_owned() + &rows.collect::<String>()
}

#[test]
fn a_mirrored_azimuth_is_named_with_its_remedy() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    for recipe in [MASKED, WHOLE] {
        let samples = pattern(Path::new(recipe)).len();
        for is_named in [false, true] {
            let write = |sign| {
                let text = at_directions(Path::new(recipe), sign, is_named);
                fs::write(directory.join("a.csv"), text).expect("written");
            };
            let fit = ["fit", recipe, "--measurements", "a.csv", "--out", "out"];
            write(-1.0);
            let message = fail(directory, &fit);
            for part in ["a.csv", "phi_i", "phi_o", "phi_d", &samples.to_string()] {
                assert!(message.contains(part), "no {part} in {message}");
            }
            assert!(!directory.join("out").exists());
            // The remedy.
            write(1.0);
            succeed(directory, &[&fit[..], &["--force"]].concat());
            fs::remove_dir_all(directory.join("out")).expect("it is there");
        }
    }
}

#[test]
fn a_fitted_material_reports_on_itself_in_fields() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let material_of = |folder: &str| {
        let path = directory.join(folder).join("material.json");
        json(&fs::read_to_string(path).expect("it is there"))
    };
    let fit = |recipe: &str, out: &str| {
        let fit = ["fit", recipe, "--measurements", "a.csv", "--out", out];
        succeed(directory, &fit);
        material_of(out)
    };
    fs::write(
        directory.join("a.csv"),
        csv(Path::new(MASKED), &shuffled(Some(1))),
    )
    .expect("written");
    let found = fit(MASKED, "masked");
    let bytes = fs::read(MASKED).expect("it is there");
    let recipe = Recipe::parse(&bytes).expect("it is a recipe");
    for (field, expected) in [
        ("/format", json!("glimpse-material")),
        ("/version", json!(1)),
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
        ("/measured/rows", json!(15)),
        ("/readings/used", json!(14)),
        (
            "/readings/excluded",
            json!([
                { "sample": 1, "reason": "outlier" },
                { "sample": 3, "reason": "missing" },
            ]),
        ),
        ("/expected_loss/source", json!("readings")),
        ("/expected_loss/materials", Value::Null),
    ] {
        assert_eq!(found.pointer(field), Some(&expected), "{field}");
    }
    let trainer = found["trainer"].as_str().expect("a version");
    assert!(trainer.starts_with(env!("CARGO_PKG_VERSION")), "{trainer}");
    for number in ["/residual/mean", "/residual/worst", "/expected_loss/loss"] {
        assert!(
            found.pointer(number).is_some_and(Value::is_number),
            "{number}"
        );
    }
    // No text is longer than a name or a version.
    let mut left = vec![&found];
    while let Some(value) = left.pop() {
        match value {
            Value::String(text) => assert!(text.split(' ').count() <= 3, "{text}"),
            Value::Array(list) => left.extend(list),
            Value::Object(fields) => left.extend(fields.values()),
            _ => {}
        }
    }

    // A recipe that states its loss, and predicts none.
    let train = "train --model phong --schedule joint --samples 4 --data procedural:12 --effort quick \
                 --out p.recipe";
    succeed(directory, &train.split_whitespace().collect::<Vec<_>>());
    let all: Vec<(usize, f32)> = (0..4).map(|sample| (sample, 1.0)).collect();
    fs::write(
        directory.join("a.csv"),
        csv(&directory.join("p.recipe"), &all),
    )
    .expect("written");
    let found = fit("p.recipe", "stated");
    assert_eq!(
        (
            &found["expected_loss"]["source"],
            &found["expected_loss"]["materials"]
        ),
        (&json!("validation"), &json!(1))
    );
}

/// As an earlier version wrote it.
#[test]
fn a_fitted_material_of_before_is_still_read() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let old = json!({
        "format": "glimpse-material",
        "version": 1,
        "name": "gold",
        "model": "phong",
        "trainer": "0.2.0",
        "expected_loss": { "loss": 0.01, "from": "as the recipe promises, 0.0100" },
        "basis": null,
        "values": [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7],
    });
    fs::write(directory.join("material.json"), old.to_string()).expect("written");
    fs::write(directory.join("a.csv"), "theta_h,theta_d,phi_d\n1,2,3\n").expect("written");
    let query = ["query", "material.json", "--angles", "a.csv"];
    assert_eq!(succeed(directory, &query).lines().count(), 2);
}
