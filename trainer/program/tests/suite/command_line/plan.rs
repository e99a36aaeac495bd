//! `trainer plan`, and the positions of the arms in `trainer inspect`.

use glimpse_core::recipe::Recipe;
use glimpse_materials::Source;
use serde_json::Value;

use super::folder::NEURAL_N8;
use super::{Folder, number};
use crate::common::assert_names;

/// A recipe that tolerates missing readings, for arms that reach 80 degrees and stay 10 degrees apart.
const MASKED: &str = "neural-n16.recipe";

/// A folder with a recipe of eight samples that needs all readings, and with [`MASKED`].
fn folder() -> Folder {
    let folder = Folder::with("n8.recipe", NEURAL_N8);
    folder.add_bundled("masked/neural-n16.recipe");
    folder
}

fn plan_as_json(folder: &Folder, options: &str) -> Value {
    folder.succeed_as_json(&format!("plan n8.recipe {options}"))
}

#[test]
fn plan_beats_own_order() {
    let folder = folder();
    let route = plan_as_json(&folder, "--out plan.csv --blank sheet.csv");
    assert_eq!(route["order"], "travel");
    assert_eq!(route["samples"], 8);
    let [total, moving, settling] =
        ["seconds", "moving_seconds", "settling_seconds"].map(|name| number(&route[name]));
    let own = number(&plan_as_json(&folder, "--order progressive")["moving_seconds"]);
    assert!(moving < 0.7 * own, "{moving} {own}");
    assert!((total - moving - settling).abs() < 1e-9 && (settling - 4.0).abs() < 1e-9);
    assert!((number(&route["visits"][7]["seconds"]) - total).abs() < 1e-9);

    // `query` reads the plan as CSV. Its directions have the same BRDF as those of the pattern.
    let csv = folder.read_text("plan.csv");
    assert!(csv.starts_with("index,theta_i,phi_i,theta_o,phi_o,seconds\n"));
    let indices = folder.column("plan.csv", "index").into_iter();
    let indices = indices.map(|index| index.parse().expect("a number"));
    let indices: Vec<usize> = indices.collect();
    let mut sorted = indices.clone();
    sorted.sort_unstable();
    assert_eq!(sorted, (0..8).collect::<Vec<_>>());
    let recipe = Recipe::parse(NEURAL_N8).expect("a valid recipe");
    let pattern: Vec<_> = recipe.pattern().collect();
    let material = &Source("procedural:1:4".into())
        .load()
        .expect("the material loads")[0];
    let printed = folder.succeed("query procedural:1:4 --angles plan.csv");
    for (row, index) in printed.lines().skip(1).zip(indices) {
        let values = row.split(',').skip(5);
        for (value, expected) in values.zip(material.at_angles(pattern[index])) {
            let value: f32 = value.parse().expect("a number");
            assert!(
                (value - expected).abs() < 1e-3 * (1.0 + expected),
                "{row}: {expected}"
            );
        }
    }

    assert!(!csv.contains("-0.0000"), "{csv}");
    let sheet = folder.read_text("sheet.csv");
    assert!(sheet.starts_with("index,theta_i,phi_i,theta_o,phi_o,r,g,b\n"));
    for (row, planned) in sheet.lines().zip(csv.lines()).skip(1) {
        let angles: Vec<&str> = planned.split(',').take(5).collect();
        assert_eq!(row, angles.join(",") + ",,,");
    }
    let seconds = [total, moving].map(|seconds| format!("{seconds:.1}"));
    let printed = folder.succeed("plan n8.recipe");
    assert_names(&printed, &seconds.each_ref().map(String::as_str));
}

#[test]
fn reports_samples_out_of_reach() {
    let folder = folder();
    let message = folder.fail("plan n8.recipe --max-theta-o 56 --out plan.csv");
    assert_names(&message, &["2", "8", "max_theta_o", "--max-theta-i"]);
    for visit in plan_as_json(&folder, "")["visits"]
        .as_array()
        .expect("a list")
    {
        let [index, theta_o] = ["index", "theta_o"].map(|name| number(&visit[name]));
        if theta_o > 56.0 {
            assert_names(&message, &[&index.to_string(), &format!("{theta_o:.2}")]);
        }
    }
    assert!(!folder.exists("plan.csv"));

    // The recipe's limits apply by default.
    let route = folder.succeed_as_json(&format!("plan {MASKED}"));
    for (limit, degrees) in [
        ("max_theta_i", 80.0),
        ("max_theta_o", 80.0),
        ("min_separation", 10.0),
    ] {
        let stated = number(&route["machine"][limit]);
        assert!((stated - degrees).abs() < 1e-3, "{limit} {stated}");
    }
    folder.fail(&format!("plan {MASKED} --max-theta-i 70"));
    folder.fail_naming("plan n8.recipe --in-plane", &["8", "in_plane"]);
}

/// A machine without azimuths: a recipe that was trained for it is planned, read and continued with two signed angles.
#[test]
fn machine_in_one_plane_has_two_axes() {
    let folder = Folder::with("n8.recipe", NEURAL_N8);
    let train = "train --samples 6 --effort brief --data procedural:8 --in-plane --scan-seconds 12 --speed 20,10";
    folder.succeed(&format!("{train} --model neural --out p.recipe"));
    let route = folder.succeed_as_json("plan p.recipe --out plan.csv --blank sheet.csv");
    assert!(number(&route["seconds"]) <= 12.0 && route["machine"]["in_plane"] == true);
    let (mut seconds, mut before) = (0.0, [0.0; 2]);
    for visit in route["visits"].as_array().expect("a list") {
        let [theta_i, theta_o] = ["theta_i", "theta_o"].map(|name| number(&visit[name]));
        assert!(theta_i >= 0.0 && visit["phi_o"].is_null(), "{visit}");
        let moved = [(theta_i - before[0]) / 20.0, (theta_o - before[1]) / 10.0];
        seconds += 0.5 + moved.map(f64::abs).into_iter().fold(0.0, f64::max);
        assert!((number(&visit["seconds"]) - seconds).abs() < 1e-3);
        before = [theta_i, theta_o];
    }
    let headers = ["plan.csv", "sheet.csv"].map(|file| folder.read_text(file));
    assert!(headers[0].starts_with("index,theta_i,theta_o,seconds\n"));
    assert!(headers[1].starts_with("index,theta_i,theta_o,r,g,b\n"));

    // `fit` reads the sheet, and `next` continues it in the plane.
    folder.succeed("query procedural:1:9 --angles sheet.csv --out read.csv");
    let report = folder.succeed_as_json("fit p.recipe --measurements read.csv --out fit");
    let [used, off] = ["/readings/used", "/measured/furthest_degrees"]
        .map(|field| report[0].pointer(field).map_or(f64::NAN, number));
    assert!(used == 6.0 && off < 0.01, "{report}");
    let next = "next p.recipe --measurements read.csv --speed 20,10 --blank next.csv";
    let proposal = &folder.succeed_as_json(next)["directions"][0];
    assert!(proposal["phi_i"].is_null() && number(&proposal["seconds"]) > 0.5);
    assert!(
        folder
            .read_text("next.csv")
            .starts_with("theta_i,theta_o,r,g,b\n")
    );

    folder.fail_each(
        "plan p.recipe",
        &[
            "--speed 20,10,20,10 => --speed --in-plane",
            "--no-full-turns => --no-full-turns --in-plane",
        ],
    );
    folder.fail_naming("plan n8.recipe --speed 20,10", &["--speed", "--in-plane"]);
}

#[test]
fn rejects_invalid_options() {
    let folder = folder();
    let before = folder.names("");
    folder.fail_each(
        "plan n8.recipe",
        &[
            "--speed fast => --speed fast",
            "--speed 10,0,10,0 => phi_i phi_o 0",
            "--settle -1 => -1",
            "--max-theta-i 95 => --max-theta-i 90",
            "--max-theta-i 20 --max-theta-o 20 --min-separation 50 => ",
            "--force => --force",
            "--out a.csv --blank ./a.csv => --out --blank",
            "--blank n8.recipe => n8.recipe",
        ],
    );
    assert_eq!(folder.names(""), before, "a file was written");
}
