//! `trainer evaluate`: accuracy of its numbers, and comparisons.

use std::collections::HashSet;

use glimpse_evaluation::evaluation::SPHERE_SIZE;
use glimpse_fitting::recipe::{Metadata, RecipeFile};
use glimpse_materials::{Identity, Material, Procedural, digest};
use serde_json::{Value, json};

use super::folder::{COOK_TORRANCE_N8, NEURAL_N8, PHONG_N8};
use super::render::pixels_of_png;
use super::shared::{LINEAR_N2, TRAIN};
use super::{Folder, number};
use crate::common::assert_names;

const RECIPES: [(&str, &[u8]); 3] = [
    ("phong.recipe", PHONG_N8),
    ("neural.recipe", NEURAL_N8),
    ("cook-torrance.recipe", COOK_TORRANCE_N8),
];
/// All recipes, as an option.
const ALL: &str = "--recipe phong.recipe neural.recipe cook-torrance.recipe";

fn folder() -> Folder {
    let folder = Folder::new();
    for (name, bytes) in RECIPES {
        folder.write(name, bytes);
    }
    folder
}

/// The report of `evaluate`.
fn evaluate(folder: &Folder, options: &str) -> Value {
    folder.succeed_as_json(&format!("evaluate {options}"))
}

/// The loss on each material of a report.
fn losses(report: &Value) -> Vec<f64> {
    let materials = report["materials"].as_array().expect("a list").iter();
    materials
        .map(|material| number(&material["loss"]))
        .collect()
}

/// The mean of a list, and its standard error.
fn mean_and_error(list: &[f64]) -> [f64; 2] {
    let count = list.len() as f64;
    let mean = list.iter().sum::<f64>() / count;
    let squares: f64 = list.iter().map(|value| (value - mean).powi(2)).sum();
    [mean, (squares / (count - 1.0) / count).sqrt()]
}

#[test]
fn compares_recipes_by_paired_differences() {
    let folder = folder();
    let options = format!("{ALL} --test procedural:2:3");
    let all = evaluate(&folder, &options);
    // The report of each recipe equals that of a separate evaluation.
    let alone = evaluate(&folder, "--recipe neural.recipe --test procedural:2:3");
    assert_eq!(all["recipes"][1], alone);
    let [_, error] = mean_and_error(&losses(&alone));
    let standard_error = number(&alone["loss_standard_error"]);
    assert!(
        (standard_error / error - 1.0).abs() < 1e-9,
        "{standard_error}, {error}"
    );
    let first = losses(&all["recipes"][0]);
    for (index, name) in [(1, "neural.recipe"), (2, "cook-torrance.recipe")] {
        let difference = &all["differences"][index - 1];
        assert_eq!(difference["recipe"], name);
        assert_eq!(difference["base"], "phong.recipe");
        let pairs = losses(&all["recipes"][index]).into_iter().zip(&first);
        let pairs: Vec<f64> = pairs.map(|(a, b)| a - b).collect();
        let [mean, error] = mean_and_error(&pairs);
        assert!((number(&difference["loss"]) - mean).abs() < 1e-12);
        assert!((number(&difference["standard_error"]) - error).abs() < 1e-12);
        let less = pairs.iter().filter(|pair| **pair < 0.0).count();
        assert_eq!(difference["less_loss_on"], json!(less));
    }
    let text = folder.succeed(&format!("evaluate {options}"));
    let mut lines = text.lines();
    let row = lines.find(|line| line.starts_with("| cook-torrance.recipe"));
    let figures = ["loss", "standard_error"]
        .map(|field| format!("{:.4}", number(&all["differences"][1][field])));
    assert_names(row.expect("a row"), &figures.each_ref().map(String::as_str));
}

#[test]
fn writes_page_of_spheres() {
    let folder = folder();
    let options = "evaluate --recipe phong.recipe neural.recipe --test procedural:2:3";
    let printed = folder.succeed(options);
    assert_eq!(folder.succeed(&format!("{options} --out page")), printed);
    // For each of two materials, itself and two fits.
    let names = folder.names("page/pictures");
    assert_eq!(names.len(), 2 * 3, "{names:?}");
    let spheres = names.iter().map(|name| {
        let picture = pixels_of_png(&folder.at("page/pictures").join(name));
        assert_eq!([picture.width, picture.height], [SPHERE_SIZE; 2]);
        picture.pixels
    });
    let spheres: HashSet<_> = spheres.collect();
    assert_eq!(spheres.len(), names.len(), "two spheres are equal");
    let page = folder.read_text("page/index.html");
    assert_names(&page, &["phong.recipe", "neural.recipe", "Scan (s)"]);
}

/// Writes a recipe of Linear, and its basis, that states these training materials.
fn write_recipe_trained_on(folder: &Folder, materials: &[(&str, u32)]) {
    let identities = materials.iter().map(|(name, digest)| Identity {
        name: (*name).to_owned(),
        digest: *digest,
    });
    LINEAR_N2.copy_to(folder.path());
    let file = RecipeFile::read(&folder.at("linear-n2.recipe")).expect("a valid recipe");
    let file = file.with_metadata(&Metadata {
        materials: identities.collect(),
        ..file.metadata().clone()
    });
    let file = file.expect("a valid recipe");
    folder.write("k.recipe", file.bytes());
    folder.write("k.basis", folder.read("linear-n2.basis"));
}

#[test]
fn marks_training_materials() {
    let folder = folder();
    let set = Procedural::set(3, 0);
    let evaluate_on = |test| evaluate(&folder, &format!("--recipe k.recipe --test {test}"));

    // One training material under another name, one with the same name only, and an unseen material.
    let trained_on = [("another-name", digest(&set[1])), (set[2].name(), 7)];
    write_recipe_trained_on(&folder, &trained_on);
    let report = evaluate_on("procedural:3");
    assert_eq!(report["trained_on"], json!([set[1].name()]));
    assert_eq!(report["namesakes_trained_on"], json!([set[2].name()]));
    let overlaps = [0, 1, 2].map(|index| &report["materials"][index]["overlap"]);
    assert_eq!(overlaps, ["unseen", "same-brdf", "same-name"]);
    assert_eq!(report["new"]["materials"], 1);
    assert_eq!(report["new"]["loss"], report["materials"][0]["loss"]);

    // The text report names them once more, in addition to the rows of all materials.
    let command = "evaluate --test procedural:2 --recipe k.recipe";
    let text = folder.succeed_with_messages(command).concat();
    let times = |index: usize| text.matches(set[index].name()).count();
    assert_eq!((times(0), times(1)), (1, 2), "{text}");

    // All materials are unseen.
    write_recipe_trained_on(&folder, &[("another", 1)]);
    let report = evaluate_on("procedural:1");
    assert_eq!(report["trained_on"], json!([]));
    assert_eq!(report.get("new"), None);

    // A recipe that does not name its training materials.
    write_recipe_trained_on(&folder, &[]);
    let report = evaluate_on("procedural:1");
    assert_eq!(report["trained_on"], Value::Null);
    assert_eq!(report["materials"][0]["overlap"], Value::Null);
}

#[test]
fn expected_loss_names_its_materials() {
    let folder = folder();
    let train = TRAIN.replace("--samples 4", "--samples 1");
    let train = train.replace("procedural:12", "procedural:1");
    let [_, messages] = folder.succeed_with_messages(&train.replace("phong.recipe", "one.recipe"));
    let recipe = folder.succeed_as_json("inspect one.recipe");
    assert_eq!(recipe["metadata"]["expected_loss"]["split"], "training");
    let options = "--recipe one.recipe --test procedural:1:3";
    let report = evaluate(&folder, options);
    assert_eq!(report["promise"]["estimate"]["materials"], 1);
    // A single material has no standard error.
    assert_eq!(report["loss_standard_error"], Value::Null);
    // Training, `inspect` and `evaluate` print the loss with its materials.
    let loss = format!("{:.4}", number(&report["promise"]["estimate"]["loss"]));
    let printed = folder.succeed("inspect one.recipe");
    let text = folder.succeed(&format!("evaluate {options}"));
    for text in [messages, printed, text] {
        assert_names(&text, &[&loss, "1", "procedural:1"]);
    }
    assert_eq!(report["promise"]["standard_error"], Value::Null);
}
