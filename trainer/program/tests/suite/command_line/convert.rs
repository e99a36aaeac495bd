//! `trainer convert`

use serde_json::json;

use super::{Folder, number};

#[test]
fn converts_between_formats() {
    let folder = Folder::new();
    let report = folder.succeed_as_json("convert procedural:1:3 made.binary");
    let bytes = folder.read("made.binary").len();
    for (field, expected) in [
        ("format", json!("merl")),
        ("material", json!("procedural-3-000-metal")),
        ("files", json!([{ "path": "made.binary", "bytes": bytes }])),
    ] {
        assert_eq!(report[field], expected, "{field}");
    }
    assert!(number(&report["loss"]) < 0.005, "{report}");
    // The loss of a conversion is the last printed word.
    let convert = |arguments: &str| -> f64 {
        let printed = folder.succeed(&format!("convert {arguments}"));
        let number = printed.split_whitespace().last();
        number.expect("a number").parse().expect("a number")
    };
    let tensors = convert("made.binary made_rgb.bsdf");
    assert!(tensors < 0.002, "{tensors}");
    // A file of the same format has nothing to convert.
    folder.fail_naming(
        "convert made.binary copy --format merl",
        &["made.binary", "merl"],
    );

    let text = convert("made.binary made --format pab");
    assert!(text < 0.2, "{text}");
    let again = convert("made_in30.txt text.bsdf --as-fitted");
    assert!(again < 0.002, "{again}");

    let network = convert("made_rgb.bsdf net --format nbrdf");
    assert!(network < 0.02, "{network}");
    // A tensor file has both orders of light and sensor.
    let tensors = convert("net_fc1.npy net_rgb.bsdf --as-fitted");
    assert!(tensors < 0.002, "{tensors}");
    let report = folder.succeed_as_json("convert net_fc1.npy mean_rgb.bsdf");
    let reciprocity = |state: &str| number(&report[state]["reciprocity"]);
    assert!(
        reciprocity("after") < 0.5 * reciprocity("before"),
        "{report}"
    );
    for array in ["fc1", "b1", "fc2", "b2", "fc3", "b3"] {
        let bytes = folder.read(&format!("net_{array}.npy"));
        assert!(bytes.starts_with(b"\x93NUMPY"));
    }
}

#[test]
fn rejects_invalid_arguments() {
    let folder = Folder::new();
    folder.succeed("convert procedural:1:3 made_rgb.bsdf");
    let before = folder.read("made_rgb.bsdf");
    folder.fail_each(
        "convert",
        &[
            "procedural:2 made.binary => procedural:2 2",
            "procedural:1 made => made --format .binary .bsdf",
            "procedural:1 made.binary --format rgl => made.binary --format merl",
            "procedural:1 made.npy => made.npy",
            "made_rgb.bsdf made_rgb.bsdf => made_rgb.bsdf",
            "procedural:1 made_rgb.bsdf => made_rgb.bsdf --force",
            "procedural:1 none/made.binary => none",
            "made_rgb.bsdf mean --format nbrdf --as-fitted => --as-fitted nbrdf",
        ],
    );
    assert_eq!(folder.names(""), ["made_rgb.bsdf"]);
    assert_eq!(folder.read("made_rgb.bsdf"), before);
    folder.succeed("convert procedural:1 made_rgb.bsdf --force");
    assert_ne!(folder.read("made_rgb.bsdf"), before);
}
