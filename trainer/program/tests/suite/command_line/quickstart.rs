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
    // The mean of all bytes, 0 to 255, of pictures whose names end with a label.
    let brightness = |label: &str| {
        let of_label = names.iter().filter(|name| name.ends_with(label));
        let bytes = of_label.flat_map(|name| {
            let pixels = pixels_of_png(&folder.at("q/pictures").join(name)).pixels;
            pixels.into_flattened()
        });
        let bytes: Vec<f64> = bytes.map(f64::from).collect();
        bytes.iter().sum::<f64>() / bytes.len() as f64
    };
    let reference = brightness("-reference.png");
    for method in [
        "-neural-n8.png",
        "-the-paper-s.png",
        "-meta.png",
        "-glimpse.png",
    ] {
        let fit = brightness(method);
        assert!(fit > 0.5 * reference, "{method}: {fit} of {reference}");
    }
}
