//! Schedule prior on the command line.

use glimpse_core::recipe::Recipe;
use glimpse_evaluation::evaluation::names;
use glimpse_fitting::recipe::Metadata;
use serde_json::Value;

use super::{Folder, number};
use crate::common::assert_names;

#[test]
fn trains_inspects_exports_and_evaluates_prior_recipes() {
    let folder = Folder::new();
    for (model, list, length) in [
        ("linear", "/ridge/rows", 3 * 24),
        ("phong", "/start/output", 32 * 7),
    ] {
        let recipe = format!("{model}.recipe");
        folder.succeed(&format!(
            "train --model {model} --samples 3 --effort brief --data procedural:9:1 \
             --data procedural:3:2 --share 2,8 --missing 0.5 --noise 0.02 --additive 0.01 \
             --levels 4096 --max-theta-i 70 --min-separation 10 --out {recipe}"
        ));

        let printed = folder.succeed(&format!("inspect {recipe}"));
        let figures = [
            "3", "24", "0.5", "0.02", "0.01", "4096", "70.0", "90.0", "10.0", "12", "0.200",
            "0.800",
        ];
        assert_names(&printed, &figures);
        assert_names(&printed, &["procedural:9:1", "procedural:3:2"]);

        let export = |format: &str| {
            let out = format!("{model}.{format}");
            folder.succeed(&format!("export {recipe} --format {format} --out {out}"));
            out
        };
        let value = folder.read_json(&export("json"));
        for (list, length) in [
            ("/net/readings", 9 * 88),
            ("/net/output_scales", 24),
            ("/prediction/weights", 25),
            (list, length),
        ] {
            let array = value.pointer(list).and_then(Value::as_array);
            assert_eq!(array.map(Vec::len), Some(length), "{list}");
        }
        // All directions are within the machine's limits.
        let bytes = folder.read(&recipe);
        let recipe = Recipe::parse(&bytes).expect("a valid recipe");
        let metadata = Metadata::of(&recipe).expect("valid metadata");
        let limits = metadata.machine().limits;
        let is_within = |at| limits.check(&at).is_ok();
        assert!(recipe.directions().all(|(_, at)| is_within(at)));
        assert!((limits.min_separation.to_degrees() - 10.0).abs() < 1e-4);
    }

    let evaluate = "evaluate --recipe phong.recipe --test procedural:1:77";
    let report = folder.succeed_as_json(evaluate);
    assert_eq!(report["method"], names::GLIMPSE);
    let loss = number(&report["loss"]);
    assert!((0.001..0.08).contains(&loss), "{loss}");

    // Fewer readings change the predicted loss.
    let predicted = |report: &Value| {
        let first = &report["materials"][0]["predicted_loss"];
        [first, &report["prediction"]["loss"]].map(number)
    };
    let few = folder.succeed_as_json(&format!("{evaluate} --first 2 --noise 0.02"));
    let first = &report["materials"][0];
    assert!(number(&first["loss_bound"]) >= number(&first["predicted_loss"]));
    assert!(first["unlike_training"].is_boolean());
    for (all, few) in predicted(&report).into_iter().zip(predicted(&few)) {
        assert!((0.0005..0.1).contains(&all) && all != few, "{all} {few}");
    }
    assert_ne!(few["loss"], report["loss"]);
    assert_eq!([&report["seeds"], &few["seeds"]], [1, 5]);
    let [_, mean] = predicted(&report);
    assert_names(&folder.succeed(evaluate), &[&format!("{mean:.4}")]);
}

#[test]
fn evaluates_with_missing_and_noisy_readings() {
    let folder = Folder::new();
    folder.add_bundled("completed/phong-n8.recipe");
    folder.add_bundled("masked/neural-n16.recipe");
    folder.fail_each(
        "evaluate --test procedural:2:9 --recipe",
        &[
            "phong-n8.recipe --first 4 => --missing",
            "phong-n8.recipe --lose 1 => --missing",
            "neural-n16.recipe --first 17 => 17 16",
            "neural-n16.recipe --first 2 --lose 2 => --first --lose 2",
        ],
    );
    let loss = |options: &str| {
        let evaluate = "evaluate --recipe neural-n16.recipe --test procedural:1:9";
        let report = folder.succeed_as_json(&format!("{evaluate} {options}"));
        number(&report["loss"])
    };
    let [all, sixteen, eight, one] = ["", "--first 16", "--first 8", "--first 1"].map(loss);
    assert_eq!(all, sixteen);
    assert!(all < eight && eight < one && one < 0.1, "{eight} {one}");
    let [coarse, fine] = ["--levels 20", "--levels 100000"].map(loss);
    assert!(all < coarse && coarse < 0.1 && (fine / all - 1.0).abs() < 0.02);
}

/// A completion that always has many readings overfits the training materials.
#[test]
fn missing_is_default_above_32_samples() {
    let folder = Folder::new();
    for (options, tolerates_missing) in [
        ("--samples 32", false),
        ("--samples 33", true),
        ("--samples 33 --missing 0", false),
    ] {
        folder.succeed(&format!(
            "train --model linear {options} --effort brief --data procedural:3:1 --out many.recipe --force"
        ));
        let bytes = folder.read("many.recipe");
        let recipe = Recipe::parse(&bytes).expect("a valid recipe");
        assert_eq!(recipe.tolerates_missing(), tolerates_missing, "{options}");
    }
}
