//! The directions to read next, and trainings around directions that an instrument fixes.

use std::fs;

use serde_json::Value;

use super::{Folder, number};

/// Returns the angles of a proposal: theta_i, phi_i, theta_o, phi_o.
fn angles(direction: &Value) -> [f64; 4] {
    ["theta_i", "phi_i", "theta_o", "phi_o"].map(|name| number(&direction[name]))
}

/// Returns one number of each object of a list.
fn column(list: &Value, name: &str) -> Vec<f64> {
    let list = list.as_array().expect("a list");
    list.iter().map(|each| number(&each[name])).collect()
}

/// Fills in the readings of scan.csv.
fn read(folder: &Folder) {
    folder.succeed("query procedural:1:9 --angles scan.csv --out read.csv");
    fs::rename(folder.at("read.csv"), folder.at("scan.csv")).expect("the file is renamed");
}

#[test]
fn next_leads_a_scan_reading_by_reading() {
    let folder = Folder::new();
    let first = folder.succeed_as_json("next --count 2 --blank scan.csv");
    assert_eq!(first["readings"], 0);
    let before = number(&first["expected_loss"]);
    read(&folder);
    let next = "next --measurements scan.csv --target 0.03 --blank scan.csv";
    let mut losses = Vec::new();
    let report = loop {
        let report = folder.succeed_as_json(next);
        assert_eq!(report["readings"], 2 + losses.len());
        losses.push(number(&report["expected_loss"]));
        if report["is_target_reached"] == true {
            break report;
        }
        let [proposal] = &report["directions"].as_array().expect("a list")[..] else {
            panic!("one direction: {report}");
        };
        assert!(number(&proposal["expected_loss"]) < number(&report["expected_loss"]));
        assert!(losses.len() < 30, "{losses:?}");
        // Blank rows are proposed again, and only once in the sheet.
        assert_eq!(folder.succeed_as_json(next), report);
        read(&folder);
    };
    assert!(
        number(&report["bound"]) <= 0.03 && losses.len() > 2,
        "{losses:?}"
    );
    assert_eq!(report["directions"].as_array().map(Vec::len), Some(0));
    assert!(losses[losses.len() - 1] < 0.5 * before, "{losses:?}");
    folder.succeed("fit --measurements scan.csv --out fit");
    let compared = folder.succeed_as_json("compare procedural:1:9 fit/material.json");
    let loss = number(&compared["materials"][0]["loss"]);
    assert!(loss < number(&report["bound"]), "{loss}");
}

#[test]
fn lamps_are_planned_one_after_the_other() {
    let folder = Folder::new();
    let plan = folder.succeed_as_json("plan --geometry photo");
    let (lamps, losses) = (
        column(&plan["lamps"], "lamp"),
        column(&plan["lamps"], "expected_loss"),
    );
    assert!(
        losses.len() == 3 && losses.is_sorted_by(|one, next| one > next),
        "{losses:?}"
    );
    let next = folder.succeed_as_json("next --geometry photo --count 2");
    assert_eq!(column(&next["directions"], "lamp"), lamps[..2]);
    for command in ["plan", "next"] {
        let cases = ["--speed 5 => --geometry", "--blank b.csv => --geometry"];
        folder.fail_each(&format!("{command} --geometry photo"), &cases);
    }
    folder.fail_naming("plan neural-n8 --geometry photo", &["linear-any"]);
}

/// A direction is proposed once, also if its reading is unlike all others, and its quantity may stand in the file.
#[test]
fn directions_are_proposed_once() {
    let folder = Folder::new();
    folder.write(
        "scan.csv",
        "theta_i,phi_i,theta_o,phi_o,r,g,b,quantity\n40,0,30,180,0.3,0.3,0.3,reflectance-factor\n",
    );
    let next = || {
        let report = folder.succeed_as_json("next --measurements scan.csv --accept-implausible");
        angles(&report["directions"][0])
    };
    let mut proposed: Vec<[f64; 4]> = Vec::new();
    for value in ["0.3", "9", "0.2", "0.01"] {
        let direction = next();
        assert!(
            !proposed.contains(&direction) && direction[1] == 0.0,
            "{proposed:?}"
        );
        let cells = direction.map(|angle| angle.to_string()).join(",");
        let row = format!("{cells},{value},{value},{value},reflectance-factor\n");
        folder.write("scan.csv", folder.read_text("scan.csv") + &row);
        proposed.push(direction);
    }
    let report =
        folder.succeed_as_json("fit --measurements scan.csv --out fit --accept-implausible");
    assert_eq!(report[0]["measured"]["quantity"], "reflectance-factor");
}

#[test]
fn recipes_begin_with_their_own_samples() {
    let folder = Folder::new();
    folder.add_bundled("completed/neural-n4.recipe");
    let plan = folder.succeed_as_json("plan neural-n4.recipe --order progressive");
    let next = |measured: &str, count: usize| {
        let report =
            folder.succeed_as_json(&format!("next neural-n4.recipe {measured} --count {count}"));
        column(&report["directions"], "theta_i")
    };
    let own = column(&plan["visits"], "theta_i");
    let near = |list: &[f64], expected: &[f64]| {
        list.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-3)
    };
    assert!(near(&next("", 4), &own));
    // After three of them, the fourth one, then others.
    folder.succeed("next neural-n4.recipe --count 3 --blank scan.csv");
    read(&folder);
    let more = next("--measurements scan.csv", 3);
    assert!(near(&more[..1], &own[3..]) && more.len() == 3);
    assert!(own.iter().all(|theta| (theta - more[1]).abs() > 0.1));
}

#[test]
fn unusable_options_are_refused() {
    let folder = Folder::new();
    let rows = [30, 20, 0, -30, -65, 60].map(|theta_o| format!("45,{theta_o},8,8,8\n"));
    for (name, rows) in [
        ("empty.csv", ""),
        ("blank.csv", "45,30,,,\n"),
        ("own.csv", "45,30,0.1,0.1,0.1\n"),
        ("percent.csv", &rows.concat()),
    ] {
        folder.write(name, format!("theta_i,theta_o,r,g,b\n{rows}"));
    }
    folder.add_bundled("completed/neural-n4.recipe");
    folder.fail_each(
        "next",
        &[
            "--quantity brdf-cos-i => --measurements",
            "--max-theta-i 1 --max-theta-o 1 --min-separation 1.99 => widen",
            "--force => --blank",
            "--measurements empty.csv => empty.csv",
            "--measurements blank.csv => blank.csv",
            "--accept-implausible => --measurements",
            "--measurements own.csv --blank own.csv => --blank columns",
            "--measurements own.csv --blank own.csv --force => --force",
            "--measurements percent.csv => --accept-implausible",
            "neural-n4.recipe --max-theta-i 20 => samples",
        ],
    );
    folder.succeed("next --measurements percent.csv --accept-implausible");
    folder.fail_each(
        "evaluate --recipe neural-n4.recipe --test procedural:1:3",
        &[
            "--adaptive 8 --max-theta-i 20 => samples",
            "--speed 5 => --adaptive",
            "--adaptive 4 => larger",
        ],
    );
}

/// Scans that choose their directions are better than as many of a line, and seconds are counted.
#[test]
fn adaptive_scans_are_evaluated() {
    let folder = Folder::new();
    folder.succeed("recipes get linear-any neural-any");
    folder.add_bundled("completed/neural-n4.recipe");
    let evaluate = |options: &str| {
        folder.succeed_as_json(&format!(
            "evaluate --test procedural:3:5 --recipe {options}"
        ))
    };
    let loss = |report: &Value| number(&report["loss"]);
    let line = evaluate("linear-any.recipe --geometry multi-angle");
    let adaptive = evaluate("linear-any.recipe --adaptive 6");
    assert_eq!(adaptive["samples"], 6);
    assert!(adaptive["seconds"].is_null());
    assert!(loss(&adaptive) < 0.7 * loss(&line), "{adaptive} {line}");
    let timed = evaluate("linear-any.recipe --adaptive 6 --speed 10 --settle 0.5");
    assert!((3.0..60.0).contains(&number(&timed["seconds"])), "{timed}");
    // The bundled recipe continues.
    let begun = evaluate("neural-n4.recipe --adaptive 6");
    assert_eq!(begun["model"], "neural");
    assert_eq!(begun["samples"], 6);
}

#[test]
fn fixed_directions_are_the_first_samples() {
    let folder = Folder::new();
    folder.write("own.csv", "theta_i,theta_o\n45,30\n45,-20\n20,20\n");
    let train = "train --model linear --effort brief --data procedural:12:3 --in-plane";
    folder.succeed(&format!("{train} --pattern own.csv -n 5 --out five.recipe"));
    let plan = folder.succeed_as_json("plan five.recipe --in-plane --order progressive");
    for (name, expected) in [
        ("theta_i", [45.0, 45.0, 20.0]),
        ("theta_o", [30.0, -20.0, 20.0]),
    ] {
        let polar = column(&plan["visits"], name);
        let mut pairs = polar.iter().zip(expected);
        assert!(pairs.all(|(a, b)| (a - b).abs() < 1e-2), "{polar:?}");
    }
    // The last table is of another kind.
    folder.write("out.csv", "theta_i,phi_i,theta_o,phi_o\n45,0,30,90\n");
    folder.fail_each(
        &format!("{train} --out x.recipe --pattern"),
        &[
            "own.csv -n 2 => --pattern --samples",
            "own.csv -n 5 --max-theta-i 40 => --pattern row 1",
            "none.csv -n 5 => none.csv",
            "out.csv -n 5 => row 1",
        ],
    );
}
