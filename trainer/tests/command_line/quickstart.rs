//! `trainer quickstart`

use std::fs::{self, File};
use std::io::BufReader;
use std::path::Path;

use glimpse_trainer::shipped;

use super::{succeed, trainer};

/// Mean brightness of a PNG file of 8 bits a channel, 0 to 255.
fn brightness(path: &Path) -> f64 {
    let file = BufReader::new(File::open(path).expect("it is there"));
    let mut reader = png::Decoder::new(file).read_info().expect("a PNG file");
    let mut bytes = vec![0; reader.output_buffer_size().expect("a size")];
    reader.next_frame(&mut bytes).expect("pixels");
    let sum: f64 = bytes.iter().map(|byte| f64::from(*byte)).sum();
    sum / bytes.len() as f64
}

#[test]
fn it_leaves_a_page_of_all_methods_and_the_recipe_of_the_next_step() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let printed = succeed(directory, &["quickstart", "--out", "q"]);
    let out = directory.join("q");
    let bundled = shipped::find("neural-n8").expect("it is bundled");
    let left = fs::read(out.join("neural-n8.recipe")).expect("it is there");
    assert_eq!(left, bundled.bytes);
    let cycles = bundled.cycles().expect("they are measured").to_string();
    for name in ["neural-n1", "neural-n16", "procedural:8:1", &cycles] {
        assert!(printed.contains(name), "no {name} in {printed}");
    }

    // Eight materials: themselves twice, by five recipes, and by four methods.
    let pictures = fs::read_dir(out.join("pictures")).expect("a folder");
    let mut names: Vec<String> = pictures
        .map(|entry| entry.expect("an entry").file_name().into_string())
        .collect::<Result<_, _>>()
        .expect("names are text");
    names.sort_unstable();
    assert_eq!(names.len(), 8 * (2 + 5 + 4), "{names:?}");
    let of = |name: &str| brightness(&out.join("pictures").join(name));
    for name in names.iter().filter(|name| name.contains("reference")) {
        let reference = of(name);
        for method in ["neural-n8", "ours-paper", "meta-paper"] {
            let fit = of(&name
                .replace("reference-2", "reference")
                .replace("reference", method));
            assert!(
                fit > 0.5 * reference,
                "{name} {method}: {fit} of {reference}"
            );
        }
    }

    // Nothing is trained, so that there is nothing to force.
    let forced = trainer(directory, &["quickstart", "--out", "q", "--force"]);
    assert_eq!(forced.status.code(), Some(2));
}
