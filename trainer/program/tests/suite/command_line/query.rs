//! `trainer query`

use glimpse_materials::{Material, Procedural, Source, to_merl};
use serde_json::json;

use super::Folder;
use super::folder::NEURAL_N8;
use crate::common::assert_names;

/// The cells of a CSV file, as text, without the first line, which must be `header`.
fn rows(csv: &str, header: &str) -> Vec<Vec<String>> {
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some(header));
    lines
        .map(|line| line.split(',').map(str::to_owned).collect())
        .collect()
}

fn numbers(cells: &[String]) -> Vec<f32> {
    let numbers = cells.iter().map(|cell| cell.parse());
    numbers.collect::<Result<_, _>>().expect("numbers")
}

#[test]
fn writes_several_materials_to_file() {
    let folder = Folder::new();
    folder.write(
        "a.csv",
        "theta_i,phi_i,theta_o,phi_o\n30,0,30,180\n90,0,30,180\n30,0,120,0\n180,0,180,0\n",
    );
    let printed = folder.succeed("query procedural:2 --angles a.csv --out f.csv");
    assert_eq!(printed, "");
    let csv = folder.read_text("f.csv");
    let output = rows(&csv, "material,theta_i,phi_i,theta_o,phi_o,r,g,b");
    let materials = Source("procedural:2".into())
        .load()
        .expect("the materials load");
    for (rows, material) in output.chunks(4).zip(&materials) {
        for (row, cells) in rows.iter().enumerate() {
            assert_eq!(cells[0], material.name());
            // The BRDF is 0 at and below the horizon.
            let above = numbers(&cells[5..]).iter().all(|value| *value > 0.0);
            assert_eq!(above, row == 0, "{csv}");
            assert!(row == 0 || cells[5..] == ["0", "0", "0"], "{csv}");
        }
    }
    assert_eq!(output.len(), 8);
}

/// The tests of `measurement` have all other defects of tables.
#[test]
fn errors_name_file_line_and_column() {
    let folder = Folder::with("a.csv", b"theta_i,phi_i,theta_o,phi_o\n-1,0,0,0\n");
    folder.fail_each(
        "query",
        &[
            "procedural:1 --angles a.csv --out f.csv => a.csv 2 theta_i -1 --convention",
            "procedural:1 --angles none.csv --out f.csv => none.csv",
            "nowhere --angles a.csv => a.csv 2",
        ],
    );
    assert!(!folder.exists("f.csv"));
}

#[test]
fn json_equals_csv() {
    let folder = Folder::with(
        "a.csv",
        b"phi_d,theta_h,theta_d,index\n90,10,20.5,3\n0,89,89,1\n",
    );
    let query = "query procedural:2 --angles a.csv";
    let output = folder.succeed_as_json(query);
    for (field, expected) in [
        ("quantity", json!("brdf")),
        ("unit", json!("sr^-1")),
        ("times_cosine", json!(false)),
    ] {
        assert_eq!(output[field], expected, "{field}");
    }
    let listed = output["materials"].as_array().expect("a list");
    let listed = listed.iter().flat_map(|material| {
        let rows = material["rows"].as_array().expect("a list");
        rows.iter().map(|row| (&material["name"], row))
    });
    let header = "material,theta_h,theta_d,phi_d,index,r,g,b";
    let rows = rows(&folder.succeed(query), header);
    assert_eq!(rows.len(), listed.clone().count());
    for (cells, (name, row)) in rows.iter().zip(listed) {
        assert_eq!(cells[0], *name);
        let angles = ["theta_h", "theta_d", "phi_d", "index"].map(|name| row[name].as_f64());
        let brdf = [0, 1, 2].map(|channel: usize| row["brdf"][channel].as_f64());
        let values = angles.into_iter().chain(brdf);
        let values: Vec<f32> = values.map(|x| x.expect("a number") as f32).collect();
        assert_eq!(values, numbers(&cells[1..]));
    }
    // --out writes the same JSON.
    let printed = folder.succeed(&format!("{query} --json --out f.json"));
    assert_eq!(printed, "");
    assert_eq!(folder.read_json("f.json"), output);
}

#[test]
fn unmeasured_directions_are_reported_and_not_used() {
    let folder = Folder::new();
    for (theta_i, value) in [(20, 0.1), (40, 0.4)] {
        let angles = (0..9).flat_map(|theta| (0..18).map(move |phi| (10 * theta, 20 * phi)));
        let lines: String = angles
            .map(|(theta, phi)| format!("{theta} {phi} {value}\n"))
            .collect();
        let header = format!(
            "#sample_name \"card in{theta_i}\"\n#colorimetry: CIE-Y\n#format: theta phi BRDF\n#intheta {theta_i}\n\
             #inphi 0\n"
        );
        folder.write(&format!("{theta_i}.txt"), header + &lines);
    }
    folder.write("a.csv", "theta_i,theta_o\n30,10\n60,10\n5,5\n");
    let query = "query 20.txt --angles a.csv";
    let [output, messages] = folder.succeed_with_messages(query);
    let output = rows(&output, "theta_i,theta_o,r,g,b");
    for value in numbers(&output[0][2..]) {
        assert!((value - 0.25).abs() < 1e-3, "{value}");
    }
    for row in &output[1..] {
        assert_eq!(row[2..], ["", "", ""]);
    }
    assert_names(&messages, &["20 (20.txt)", "40 (40.txt)"]);
    let json = folder.succeed_as_json(query);
    assert_eq!(
        json["materials"][0]["rows"][2]["brdf"],
        json!([null, null, null])
    );
    folder.write("n8.recipe", NEURAL_N8);
    for command in [
        "train --model linear --samples 4 --data 20.txt --out card.recipe",
        "evaluate --recipe n8.recipe --test 20.txt",
        "convert 40.txt card.binary",
        "compare procedural:1 40.txt",
        "render sphere 20.txt --out card.png",
    ] {
        folder.fail_naming(command, &["20 (20.txt)", "40 (40.txt)", "trainer query"]);
    }

    // A table without blue at theta_d of 30 to 40 degrees.
    let mut table = to_merl(&Procedural::set(1, 0)[0] as &dyn Material).expect("a finite BRDF");
    for h in 0..90 {
        let start = 12 + 8 * (180 * (30 + 90 * (h + 180)));
        table[start..start + 8 * 180 * 10].copy_from_slice(&(-1.0_f64).to_le_bytes().repeat(1800));
    }
    folder.write("table.binary", table);
    folder.write("a.csv", "theta_i,theta_o\n35,35\n");
    let [output, messages] = folder.succeed_with_messages("query table.binary --angles a.csv");
    let output = rows(&output, "theta_i,theta_o,r,g,b");
    assert!(numbers(&output[0][2..]).iter().all(|value| *value > 0.0));
    assert_names(&messages, &["table", "%"]);
}
