//! `trainer query`

use std::fs;
use std::path::Path;

use glimpse_core::geometry::HalfDifference;
use glimpse_materials::Source;
use glimpse_materials::sampling::uniform_valid;
use serde_json::Value;

use super::common::assert_names;
use super::{fail, fail_naming, succeed};

const NEURAL: &[u8] = include_bytes!("../../../core/examples/recipes/neural-n8.recipe");

/// The rows of a CSV file, as text, without its first line, which must be `header`.
fn rows(csv: &str, header: &str) -> Vec<Vec<String>> {
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some(header));
    lines
        .map(|line| line.split(',').map(str::to_owned).collect())
        .collect()
}

fn numbers(cells: &[String]) -> Vec<f32> {
    cells
        .iter()
        .map(|cell| cell.parse().expect("a number"))
        .collect()
}

#[test]
fn both_kinds_of_angles_give_the_material_s_own_values() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let angles = uniform_valid(300, 1);
    let mut half = "material,phi_d,theta_h,note,theta_d\n".to_owned();
    let mut directions = "phi_o, theta_i, phi_i, theta_o\r\n".to_owned();
    for angles in &angles {
        let [theta_h, theta_d, phi_d] = [angles.theta_h, angles.theta_d, angles.phi_d]
            .map(|angle| f64::from(angle).to_degrees());
        half += &format!("any,{phi_d},{theta_h},\"one, two\",{theta_d}\n");
        let at = HalfDifference::from_angles(glimpse_core::geometry::Angles {
            theta_h: theta_h.to_radians(),
            theta_d: theta_d.to_radians(),
            phi_d: phi_d.to_radians(),
        });
        let pair = at.directions();
        let theta = |direction: [f64; 3]| direction[2].acos().to_degrees();
        let phi = |[x, y, _]: [f64; 3]| y.atan2(x).to_degrees();
        // Turned about the normal, which changes nothing.
        directions += &format!(
            "{}, {}, {}, {}\r\n",
            phi(pair.outgoing) - 77.0,
            theta(pair.incoming),
            phi(pair.incoming) - 77.0,
            theta(pair.outgoing)
        );
    }
    fs::write(directory.join("half.csv"), half).expect("it is written");
    fs::write(directory.join("directions.csv"), directions).expect("it is written");
    let material = &Source("procedural:1:4".into()).load().expect("it loads")[0];
    let query = |file| succeed(directory, &["query", "procedural:1:4", "--angles", file]);

    let found = rows(&query("half.csv"), "theta_h,theta_d,phi_d,r,g,b");
    assert_eq!(found.len(), angles.len());
    for (row, angles) in found.iter().zip(&angles) {
        assert_eq!(numbers(&row[3..]), material.brdf(*angles));
        // The angles as they were given, in degrees.
        let given = [angles.theta_h, angles.theta_d, angles.phi_d];
        let given = given.map(|angle| f64::from(angle).to_degrees().to_string());
        assert_eq!(row[..3], given);
    }
    let found = rows(
        &query("directions.csv"),
        "theta_i,phi_i,theta_o,phi_o,r,g,b",
    );
    for (row, angles) in found.iter().zip(&angles) {
        for (found, expected) in numbers(&row[4..]).into_iter().zip(material.brdf(*angles)) {
            assert!((found - expected).abs() <= 2e-4 * expected, "{angles:?}");
        }
    }
}

#[test]
fn several_materials_are_named_and_written_to_a_file() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    fs::write(
        directory.join("a.csv"),
        "theta_i,phi_i,theta_o,phi_o\n30,0,30,180\n90,0,30,180\n30,0,120,0\n180,0,180,0\n",
    )
    .expect("it is written");
    let printed = succeed(
        directory,
        &[
            "query",
            "procedural:2",
            "--angles",
            "a.csv",
            "--out",
            "f.csv",
        ],
    );
    assert_eq!(printed, "");
    let csv = fs::read_to_string(directory.join("f.csv")).expect("it is there");
    let found = rows(&csv, "material,theta_i,phi_i,theta_o,phi_o,r,g,b");
    let materials = Source("procedural:2".into()).load().expect("they load");
    for (rows, material) in found.chunks(4).zip(&materials) {
        for (row, cells) in rows.iter().enumerate() {
            assert_eq!(cells[0], material.name());
            // At the horizon and below it there is nothing.
            let above = numbers(&cells[5..]).iter().all(|value| *value > 0.0);
            assert_eq!(above, row == 0, "{csv}");
            assert!(row == 0 || cells[5..] == ["0", "0", "0"], "{csv}");
        }
    }
    assert_eq!(found.len(), 8);
}

#[test]
fn mistakes_name_the_file_the_line_and_the_column() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let query = |angles: &Path| {
        let angles = angles.display().to_string();
        fail(
            directory,
            &[
                "query",
                "procedural:1",
                "--angles",
                &angles,
                "--out",
                "f.csv",
            ],
        )
    };
    let file = directory.join("a.csv");
    let name = file.display().to_string();
    for (text, named) in [
        (
            &b"theta_h,theta_d\n1,2\n"[..],
            &["theta_h, theta_d", "phi_d", "theta_i"][..],
        ),
        (b"", &[]),
        (
            b"theta_h,theta_d,phi_d,theta_i,phi_i,theta_o,phi_o\n",
            &["theta_h, theta_d, phi_d", "theta_i, phi_i, theta_o, phi_o"],
        ),
        (b"theta_h,theta_d,phi_d,theta_d\n", &["theta_d"]),
        (
            b"theta_h,theta_d,phi_d\n1,2,3\n\n4,x,6\n",
            &["4", "theta_d", "x"],
        ),
        (
            b"\r\ntheta_h,theta_d,phi_d\r\n1,2,3\r\n\r\n\r\n4,5,x\r\n",
            &["6", "phi_d", "x"],
        ),
        (b"theta_h,theta_d,phi_d\n1,2,\n", &["2", "phi_d"]),
        (b"theta_h,theta_d,phi_d\n1,2,inf\n", &["2", "phi_d", "inf"]),
        (
            b"phi_d,theta_h,theta_d\n-1e3,90,90.01\n",
            &["2", "theta_d", "90.01", "90"],
        ),
        (
            b"theta_i,phi_i,theta_o,phi_o\n-1,0,0,0\n",
            &["2", "theta_i", "-1", "180"],
        ),
        (b"theta_h,theta_d,phi_d\n1,2,3\n1,2,3,4\n", &["3", "4"]),
        (b"theta_h,theta_d,phi_d\n1,\xff,3\n", &["2", "UTF-8"]),
    ] {
        fs::write(&file, text).expect("it is written");
        let message = query(&file);
        assert_names(&message, &[&name]);
        assert_names(&message.replace(&name, ""), named);
        assert!(!directory.join("f.csv").exists());
    }
    assert_names(&query(&directory.join("none.csv")), &["none.csv"]);
    let nowhere = ["query", "nowhere", "--angles", "a.csv"];
    fail_naming(directory, &nowhere, &["a.csv", "2"]);
}

/// Rows of a plan name their samples, which an exchange of light and sensor makes necessary.
#[test]
fn what_is_looked_up_at_a_plan_is_fitted() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    fs::write(directory.join("n8.recipe"), NEURAL).expect("it is written");
    for (name, options, swaps) in [
        ("plain", &[][..], false),
        ("swapped", &["--swap", "--max-theta-o", "80"], true),
    ] {
        let plan = ["plan", "n8.recipe", "--force", "--out", "plan.csv"];
        succeed(directory, &[&plan[..], options].concat());
        let planned = fs::read_to_string(directory.join("plan.csv")).expect("it is there");
        assert_eq!(planned.contains(",true,"), swaps, "{planned}");
        let query = ["query", "procedural:1:9", "--angles", "plan.csv"];
        succeed(directory, &[&query[..], &["--out", "read.csv"]].concat());
        let read = fs::read_to_string(directory.join("read.csv")).expect("it is there");
        let read = rows(&read, "theta_i,phi_i,theta_o,phi_o,index,r,g,b");
        for (row, planned) in read.iter().zip(planned.lines().skip(1)) {
            let own = [&row[4..5], &row[..4]].concat().join(",");
            assert!(planned.starts_with(&own), "{planned}");
        }
        let fit = ["fit", "n8.recipe", "--measurements", "read.csv", "--json"];
        let told = succeed(directory, &[&fit[..], &["--out", name]].concat());
        let told: Value = serde_json::from_str(&told).expect("it is JSON");
        assert_eq!(told[0]["readings"]["used"], 8);
        assert_eq!(told[0]["readings"]["excluded"], serde_json::json!([]));
    }
}

#[test]
fn json_holds_what_csv_does() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    fs::write(
        directory.join("a.csv"),
        "phi_d,theta_h,theta_d,index\n90,10,20.5,3\n0,89,89,1\n",
    )
    .expect("it is written");
    let query = ["query", "procedural:2", "--angles", "a.csv"];
    let csv = succeed(directory, &query);
    let found = succeed(directory, &[&query[..], &["--json"]].concat());
    let found: Value = serde_json::from_str(&found).expect("it is JSON");
    assert_eq!(
        (&found["quantity"], &found["unit"], &found["times_cosine"]),
        (&"brdf".into(), &"sr^-1".into(), &false.into())
    );
    let listed = found["materials"].as_array().expect("a list");
    let listed = listed.iter().flat_map(|material| {
        let rows = material["rows"].as_array().expect("a list");
        rows.iter().map(|row| (material["name"].clone(), row))
    });
    let header = "material,theta_h,theta_d,phi_d,index,r,g,b";
    let rows = rows(&csv, header);
    assert_eq!(rows.len(), listed.clone().count());
    for (cells, (name, row)) in rows.iter().zip(listed) {
        assert_eq!(cells[0], name);
        let angles = ["theta_h", "theta_d", "phi_d", "index"].map(|name| row[name].as_f64());
        let brdf = [0, 1, 2].map(|channel: usize| row["brdf"][channel].as_f64());
        let values = angles.into_iter().chain(brdf);
        let values: Vec<f32> = values.map(|x| x.expect("a number") as f32).collect();
        assert_eq!(values, numbers(&cells[1..]));
    }
    // A file gets the same.
    let out = ["--json", "--out", "f.json"];
    assert_eq!(succeed(directory, &[&query[..], &out].concat()), "");
    let written = fs::read(directory.join("f.json")).expect("it is there");
    assert_eq!(
        serde_json::from_slice::<Value>(&written).expect("it is JSON"),
        found
    );
}
