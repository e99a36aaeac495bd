//! Readings at any directions.

use serde_json::{Value, json};

use super::{Folder, number, numbers};

/// In-plane angles of light and sensor in degrees; the sensor's is positive on the side of the mirror direction.
const IN_PLANE: [[f64; 2]; 7] = [
    [45.0, 60.0],
    [45.0, 30.0],
    [45.0, 20.0],
    [45.0, -30.0],
    [20.0, 20.0],
    [60.0, 60.0],
    [75.0, 72.0],
];

/// Writes a table of a material's readings, `read.csv`.
fn read(folder: &Folder) -> Vec<String> {
    let rows = IN_PLANE.map(|[theta_i, theta_o]| format!("{theta_i},{theta_o}\n"));
    folder.write("angles.csv", format!("theta_i,theta_o\n{}", rows.concat()));
    folder.succeed("query procedural:1:9 --angles angles.csv --out read.csv");
    let text = folder.read_text("read.csv");
    let readings = text.lines().skip(1).map(|row| {
        let cells: Vec<&str> = row.split(',').collect();
        cells[cells.len() - 3..].join(",")
    });
    readings.collect()
}

fn values(folder: &Folder, fit: &str) -> Vec<f32> {
    numbers(&folder.read_json(&format!("{fit}/material.json"))["values"])
}

#[test]
fn every_model_completes_readings() {
    let folder = Folder::new();
    read(&folder);
    folder.succeed("recipes get linear-any neural-any phong-any cook-torrance-any");
    folder.succeed("fit --measurements read.csv --out default");
    for model in ["linear", "neural", "phong", "cook-torrance"] {
        let report = folder.succeed_as_json(&format!(
            "fit {model}-any.recipe --measurements read.csv --out {model}"
        ));
        assert_eq!(report[0]["recipe"]["model"], model);
        assert_eq!(report[0]["readings"]["used"], IN_PLANE.len());
        assert!(
            number(&report[0]["loss_scale"]["black"]) > number(&report[0]["expected_loss"]["loss"])
        );
        let compared = format!("compare procedural:1:9 {model}/material.json");
        let loss = number(&folder.succeed_as_json(&compared)["materials"][0]["loss"]);
        let [predicted, bound] =
            ["loss", "bound"].map(|name| number(&report[0]["expected_loss"][name]));
        assert!(
            loss < bound && predicted < 0.1,
            "{model}: {loss} {predicted} {bound}"
        );
    }
    assert_eq!(values(&folder, "default"), values(&folder, "linear"));
    let [fitted, deviations] =
        ["fitted_g", "deviation_g"].map(|name| folder.column("neural/readings.csv", name));
    for (fitted, deviation) in fitted.into_iter().zip(deviations) {
        let [fitted, deviation] =
            [fitted, deviation].map(|cell| cell.parse::<f64>().expect("a number"));
        assert!(
            (0.01..2.0).contains(&(deviation / fitted)),
            "{deviation} of {fitted}"
        );
    }
}

/// Noise, repeated directions, one channel, and the index of a plan.
#[test]
fn rows_state_noise_and_repeat() {
    let folder = Folder::new();
    let rows = "theta_i,theta_o,value,noise\n45,30,0.2,0.01\n45,30,0.2,0.01\n30,0,9,";
    let [exact, noisy] = [0, 5].map(|noise| {
        folder.write("a.csv", format!("{rows}{noise}\n"));
        let fit = format!("fit --measurements a.csv --out {noise} --accept-implausible");
        folder.succeed_as_json(&fit)
    });
    assert_eq!(exact[0]["readings"]["used"], 2);
    assert_eq!(exact[0]["readings"]["repeated"], 1);
    let residual = |report: &Value| number(&report[0]["residual"]["mean"]);
    assert!(residual(&noisy) > 2.0 * residual(&exact), "{noisy}");

    folder.succeed("plan --geometry in-plane --blank sheet.csv");
    let sheet = folder.read_text("sheet.csv").replace(",,,", ",0.1,0.2,0.3");
    assert!(
        !sheet.lines().nth(1).expect("a row").starts_with('0'),
        "not in the route's order"
    );
    folder.write("sheet.csv", sheet);
    let report =
        folder.succeed_as_json("fit --measurements sheet.csv --out sheet --accept-implausible");
    assert_eq!(report[0]["readings"]["used"], 32);
}

#[test]
fn readings_off_the_pattern_are_completed() {
    let folder = Folder::new();
    folder.succeed("recipes get neural-n8 linear-any");
    read(&folder);
    let fit = "fit neural-n8.recipe --measurements read.csv --out fit";
    let report = folder.succeed_as_json(fit);
    let recipe = &report[0]["recipe"];
    assert_eq!(
        [&recipe["file"], &recipe["model"]],
        ["neural-any", "neural"]
    );
    assert_eq!(recipe["off_pattern"], true);
    folder.write("noise.csv", "theta_i,theta_o,value,noise\n45,30,0.2,0.01\n");
    folder.write("index.csv", "index,value\n0,0.2\n");
    folder.fail_each(
        "",
        &[
            "fit neural-n8.recipe --measurements noise.csv --out x => noise.csv noise any",
            "fit linear-any.recipe --measurements index.csv --out x => index.csv 2",
            "plan neural-n8.recipe --geometry in-plane => --geometry neural-n8",
            "plan linear-any.recipe => --geometry linear-any",
            "evaluate --recipe linear-any.recipe --test procedural:1 => --geometry linear-any",
            "virtual-scanner --recipe linear-any.recipe --material procedural:1 --listen 127.0.0.1:0 => --geometry",
            "export linear-any.recipe --geometry no.csv --format c --out x => --geometry no.csv",
        ],
    );
}

/// A recipe for an instrument works like any other.
#[test]
fn instruments_have_recipes() {
    let folder = Folder::new();
    folder.succeed("recipes get linear-any phong-any");
    folder.succeed(
        "export phong-any.recipe --geometry multi-angle --format postcard --out six.recipe",
    );
    let inspected = folder.succeed_as_json("inspect six.recipe");
    assert_eq!(inspected["samples"], 6);
    folder.succeed("plan six.recipe --out plan.csv");
    folder.succeed("query procedural:1:9 --angles plan.csv --out read.csv");
    folder.succeed("fit six.recipe --measurements read.csv --out six");
    folder.succeed("fit phong-any.recipe --measurements read.csv --out any");
    // The host's fit has the discrepancy, too.
    let compared = folder.succeed_as_json("compare six/material.json any/material.json");
    let difference = number(&compared["materials"][0]["loss"]);
    assert!(difference > 0.0 && difference < 2e-3, "{difference}");
    let report = folder.succeed_as_json(
        "evaluate --recipe linear-any.recipe --geometry in-plane --test procedural:3:5",
    );
    assert_eq!(report["samples"], 32);
    let material = &report["materials"][0];
    assert!(
        number(&material["loss_bound"]) > number(&material["predicted_loss"]),
        "{material}"
    );
}

#[test]
fn trains_recipe_without_pattern() {
    let folder = Folder::new();
    let train = "train --samples any --effort brief";
    folder.succeed(&format!(
        "{train} --model phong --data procedural:5 --out x.recipe"
    ));
    read(&folder);
    folder.succeed("fit x.recipe --measurements read.csv --out fit");
    let inspected = folder.succeed_as_json("inspect x.recipe");
    assert_eq!(
        [
            &inspected["samples"],
            &inspected["pattern"]["expected_loss"]
        ],
        [&json!(0), &Value::Null]
    );
}
