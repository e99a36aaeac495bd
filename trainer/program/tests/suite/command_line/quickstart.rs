//! `trainer quickstart`

use glimpse_fitting::bundled;

use super::Folder;
use super::render::pixels_of_png;

#[test]
fn writes_page_and_recipe() {
    let folder = Folder::new();
    let printed = folder.succeed("quickstart --out q");
    let bundled = bundled::find("neural-n8").expect("a bundled recipe");
    assert_eq!(folder.read("q/neural-n8.recipe"), bundled.bytes);
    let cycles = bundled.cycles().expect("recorded cycles").to_string();
    for name in ["neural-n1", "neural-n16-16s", "procedural:8:1", &cycles] {
        assert!(printed.contains(name), "no {name} in {printed}");
    }

    // For each of eight materials two pictures of itself, six of recipes, and three of methods.
    let names = folder.names("q/pictures");
    assert_eq!(names.len(), 8 * (2 + 6 + 3), "{names:?}");
    // The mean of all bytes, 0 to 255.
    let brightness = |name: &str| {
        let pixels = pixels_of_png(&folder.at("q/pictures").join(name)).pixels;
        let bytes = pixels.as_flattened();
        let sum: f64 = bytes.iter().map(|byte| f64::from(*byte)).sum();
        sum / bytes.len() as f64
    };
    for name in names.iter().filter(|name| name.contains("reference")) {
        let reference = brightness(name);
        for method in ["neural-n8", "the-paper-s", "meta"] {
            let fit = brightness(
                &name
                    .replace("reference-2", "reference")
                    .replace("reference", method),
            );
            assert!(
                fit > 0.5 * reference,
                "{name} {method}: {fit} of {reference}"
            );
        }
    }
}
