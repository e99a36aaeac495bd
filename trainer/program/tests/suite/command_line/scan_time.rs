//! Recipes that are trained for the time of a scan, and scans that end at a target loss.

use serde_json::Value;

use super::shared::Shared;
use super::{Folder, number};
use crate::common::assert_names;

/// A brief training of a recipe that tolerates missing readings, for an uncommon machine.
static TRAINED: Shared = Shared::of(
    "train --model phong --samples 4 --effort brief --data procedural:12:3 --missing 0.5 \
     --scan-seconds 7 --speed 20,10,20,10 --settle 0.25 --out x.recipe",
);

fn trained() -> Folder {
    let folder = Folder::new();
    TRAINED.copy_to(folder.path());
    folder
}

#[test]
fn scan_keeps_within_its_seconds() {
    let folder = trained();
    let plan = folder.succeed_as_json("plan x.recipe");
    assert!(number(&plan["seconds"]) <= 7.0, "{plan}");
    assert_eq!(plan["machine"]["settle_seconds"], 0.25);
    let exported = folder.succeed_as_json("inspect x.recipe");
    assert_eq!(
        exported["metadata"]["training"]["options"]["scan_seconds"],
        7.0
    );
    assert_names(&folder.succeed("inspect x.recipe"), &["7", "20,10,20,10"]);
}

#[test]
fn scans_end_at_target() {
    let folder = trained();
    let evaluate = |target: &str| {
        let options = format!("--recipe x.recipe --test procedural:1:9 --target {target}");
        folder.succeed_as_json(&format!("evaluate {options}"))["target"].clone()
    };
    let first = evaluate("10");
    assert_eq!([&first["readings"], &first["early_share"]], [1.0, 1.0]);
    assert_eq!(first["early_held"], 1.0);
    assert!(number(&first["seconds"]) < number(&first["plan_seconds"]));
    let whole = evaluate("0.000001");
    assert_eq!([&whole["readings"], &whole["early_share"]], [4.0, 0.0]);
    let [seconds, plan_seconds] = ["seconds", "plan_seconds"].map(|name| number(&whole[name]));
    assert!(
        (seconds - plan_seconds).abs() < 1e-9 && plan_seconds <= 7.0,
        "{whole}"
    );
    assert_eq!(whole["early_held"], Value::Null);
}
