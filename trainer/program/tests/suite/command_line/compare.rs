//! `trainer compare`, and shading models of `trainer convert`.

use std::fs;

use serde_json::Value;

use super::{Folder, number};
use crate::common::assert_names;

#[test]
fn compares_with_reference() {
    let folder = Folder::new();
    let report =
        folder.succeed_as_json("compare procedural:1:3 procedural:1:3 procedural:1:8 --out page");
    let rows = report["materials"].as_array().expect("a list");
    assert_eq!(rows.len(), 2);
    let same = &rows[0];
    assert_eq!(
        [&same["loss"], &same["delta_e"], &same["dssim"]],
        [0.0, 0.0, 0.0]
    );
    let [loss, color] = ["loss", "delta_e"].map(|name| number(&rows[1][name]));
    assert!(loss > 0.0 && color > 0.0, "{loss} {color}");
    // A reference, a sphere and a difference for each material.
    assert_eq!(folder.names("page/pictures").len(), 6);
    assert_eq!(folder.read_text("page/errors.csv").lines().count(), 3);
    let page = folder.read_text("page/index.html");
    assert_eq!(page.matches("<svg").count(), 2);
    // Labels of fits with the same name contain their sources, and are escaped.
    for name in ["a", "b"] {
        fs::create_dir(folder.at(name)).expect("the folder is created");
        folder.succeed(&format!("convert procedural:1:3 '{name}/<gold>.binary'"));
    }
    let gold = ["a/<gold>.binary", "b/<gold>.binary"];
    let compare = format!("compare procedural:1:3 '{}' '{}'", gold[0], gold[1]);
    let printed = folder.succeed(&format!("{compare} --out gold"));
    assert_names(&printed, &gold);
    let page = folder.read_text("gold/index.html");
    for other in ["<gold>", "href=\"http", "@import"] {
        assert!(!page.contains(other), "{other}");
    }
    let pictures: Vec<&str> = page.split("src=\"").skip(1).collect();
    assert!(pictures.len() >= 5, "{page}");
    for picture in pictures {
        let (file, _) = picture.split_once('"').expect("a path");
        assert!(folder.exists(&format!("gold/{file}")), "{file}");
    }
    // Without its pictures, a page is not written.
    fs::create_dir(folder.at("full")).expect("the folder is created");
    folder.write("full/pictures", "a file instead of a folder");
    folder.fail("compare procedural:1:3 procedural:1:8 --out full");
    assert!(!folder.exists("full/index.html"));
    folder.fail_naming(
        "compare procedural:2:3 procedural:1:3",
        &["procedural:2:3", "2"],
    );
}

#[test]
fn converts_to_shading_models() {
    let folder = Folder::new();
    for (file, format) in [("m.gltf", ""), ("m.mtlx", ""), ("m_principled.json", "")] {
        let printed = folder.succeed_as_json(&format!("convert procedural:1:3 {file} {format}"));
        let [loss, color] = ["loss", "delta_e"].map(|name| number(&printed[name]));
        assert!(
            (1e-4..0.03).contains(&loss) && (0.01..6.0).contains(&color),
            "{printed}"
        );
        if file == "m.gltf" {
            let extras = folder.read_json(file)["materials"][0]["extras"].clone();
            assert_eq!([&extras["loss"], &extras["delta_e"]], [loss, color]);
        }
    }
    let principled: Value = folder.read_json("m_principled.json");
    assert_eq!(principled["type"], "principled");
    let color = principled["base_color"]["value"]
        .as_array()
        .expect("a color");
    assert_eq!(color.len(), 3);
    folder.fail_naming(
        "convert procedural:1:3 m.gltf --format merl",
        &["gltf", "m.gltf"],
    );
}
