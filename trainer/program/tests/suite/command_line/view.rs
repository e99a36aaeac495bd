//! `trainer render view`

use glimpse_core::recipe::Recipe;
use glimpse_materials::{Brdf, Procedural};
use serde_json::{Value, json};

use super::{Folder, number};

/// A folder with bundled recipes.
fn folder() -> Folder {
    let folder = Folder::new();
    for recipe in [
        "paper/phong-n8.recipe",
        "completed/cook-torrance-n8.recipe",
        "paper/neural-n8.recipe",
        "masked/neural-n16.recipe",
        "completed/linear-n8.recipe",
    ] {
        folder.add_bundled(recipe);
    }
    folder
}

/// The data that a page contains for its scripts.
fn data(page: &str) -> Value {
    let (_, data) = page
        .split_once("<script type=\"application/json\" id=\"data\">")
        .expect("a data element");
    let (data, _) = data.split_once("</script>").expect("the end of the script");
    serde_json::from_str(data).expect("valid JSON")
}

#[test]
fn page_contains_recipes_and_readings() {
    let folder = folder();
    let names = ["phong-n8", "cook-torrance-n8", "neural-n8", "neural-n16"];
    let recipes = names.map(|name| format!("{name}.recipe"));
    let view = format!(
        "render view {} --material procedural:1:77",
        recipes.join(" ")
    );
    assert_eq!(folder.succeed(&view), "");
    let html = folder.read_text("view.html");
    // The page loads nothing from outside.
    for external in ["http://", "https://", "src=", "@import", "fetch("] {
        assert!(!html.contains(external), "{external}");
    }
    assert!(
        html.contains("<script>\"use strict\";"),
        "scripts must not be escaped"
    );
    let data = data(&html);
    assert_eq!(data["title"], "procedural-77-000-metal");
    assert!(number(&data["reference"]["table_loss"]) < 2e-3);
    let scans = data["shown"].as_array().expect("a list");
    let values = |name: &str| -> Vec<&Value> { scans.iter().map(|scan| &scan[name]).collect() };
    assert_eq!(
        values("model"),
        ["phong", "cook-torrance", "neural", "neural"]
    );
    assert_eq!(values("name"), names);
    assert_eq!(values("takes_missing"), [false, false, false, true]);
    let material = &Procedural::set(1, 77)[0];
    for (recipe, scan) in recipes.iter().zip(scans) {
        let bytes = folder.read(recipe);
        let recipe = Recipe::parse(&bytes).expect("a valid recipe");
        let samples = scan["samples"].as_array().expect("a list");
        assert_eq!(samples.len(), recipe.samples());
        for (sample, angles) in samples.iter().zip(recipe.pattern()) {
            // The text restores the same 32-bit floats.
            let read: [f32; 3] =
                serde_json::from_value(sample["brdf"].clone()).expect("three numbers");
            assert_eq!(read, material.at_angles(angles));
        }
    }

    // The noise depends on the seed only.
    let noisy = |seed| {
        folder.succeed(&format!(
            "{view} --noise 0.05 --seed {seed} --out noisy.html --force"
        ));
        folder.read("noisy.html")
    };
    assert!(noisy(1) == noisy(1) && noisy(1) != noisy(2));
}

#[test]
fn page_of_lab_readings_without_reference() {
    let folder = folder();
    let rows = "index,r,g,b\n0,0.2,0.1,0.05\n3,0.3,0.2,0.1\n7,,,\n9,0.25,0.12,0.06\n";
    folder.write("<gold>.csv", rows);
    let view = "render view neural-n16.recipe --measurements <gold>.csv";
    folder.succeed(view);
    let html = folder.read_text("view.html");
    let data = data(&html);
    assert_eq!(data["title"], "<gold>");
    assert_eq!(data["reference"], json!(null));
    let samples = data["shown"][0]["samples"].as_array().expect("a list");
    let read = samples.iter().filter(|sample| !sample["brdf"].is_null());
    assert_eq!(read.count(), 3);
    assert!(!html.contains("<gold>"), "unescaped name");

    folder.succeed(&format!(
        "{view} --reference procedural:1:2 --out both.html"
    ));
    folder.fail_naming(
        "render view neural-n8.recipe --measurements <gold>.csv",
        &["<gold>.csv", "8"],
    );

    // Readings at other directions have a direction to read next, the one of `trainer next`.
    assert!(data["shown"][0]["next"].is_null());
    folder.write("any.csv", "theta_i,theta_o,r,g,b\n45,30,0.2,0.1,0.1\n");
    folder.succeed("render view neural-n8.recipe --measurements any.csv --out any.html");
    let scan = &self::data(&folder.read_text("any.html"))["shown"][0];
    let next = &scan["next"];
    let proposed = &folder.succeed_as_json("next neural-n8.recipe --measurements any.csv");
    for name in ["theta_i", "theta_o"] {
        let difference = number(&next[name]) - number(&proposed["directions"][0][name]);
        assert!(difference.abs() < 1e-3, "{next} {proposed}");
    }

    // It names the recipe that fits them, which without an argument is that of `trainer fit`.
    let title = &scan["name"];
    assert!(
        title
            .as_str()
            .is_some_and(|name| name.starts_with("neural-any ")),
        "{title}"
    );
    folder.succeed("render view --measurements any.csv --out own.html");
    let own = &self::data(&folder.read_text("own.html"))["shown"][0];
    assert_eq!([&own["name"], &own["model"]], ["linear-any", "linear"]);

    // The page has the fit of `trainer fit` instead of a recipe.
    let fit = &scan["fit"];
    let report = folder.succeed_as_json("fit neural-n8.recipe --measurements any.csv --out fit");
    for field in ["/expected_loss/loss", "/expected_loss/bound"] {
        let [shown, reported] =
            [fit, &report[0]].map(|of| of.pointer(field).map_or(f64::NAN, number));
        assert!((shown - reported).abs() < 1e-6, "{field}: {fit} {report}");
    }
    assert!(number(&fit["table_loss"]) < 5e-3, "{}", fit["table_loss"]);
    assert_eq!([&scan["recipe"], &scan["basis"]], [&json!(null); 2]);
    assert!(data["shown"][0]["fit"].is_null() && data["shown"][0]["recipe"].is_string());
}

#[test]
fn rejects_invalid_arguments() {
    let folder = folder();
    folder.write("a.csv", "index,r,g,b\n0,1,1,1\n");
    folder.fail_each("render view", &[
"--material procedural:1 => RECIPE",
"--measurements a.csv a.csv => 2 --measurements 1",
"neural-n8.recipe => --material --measurements",
"neural-n8.recipe neural-n8.recipe --material procedural:1 => neural-n8",
"linear-n8.recipe --material procedural:1:77 => linear-n8.basis",
"neural-n8.recipe --material procedural:2 => 2",
"neural-n8.recipe --measurements a.csv a.csv => 2 --measurements 1",
"neural-n8.recipe --measurements a.csv --noise 0.1 => --noise",
"neural-n8.recipe --material procedural:1 --noise 1.5 => 0 1",
"neural-n8.recipe --material procedural:1 --reference procedural:1 => --material --reference",
"neural-n8.recipe --material procedural:1 --out a.png => .html",
"nothing.recipe --material procedural:1:77 => nothing.recipe",
]);
    assert!(!folder.exists("view.html"));
}
