//! `trainer quickstart`

use std::collections::HashSet;

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
    // A material itself is shown twice, and a recipe may be that of a method. No other pictures are equal, such as black ones.
    let picture = |name: &String| pixels_of_png(&folder.at("q/pictures").join(name)).pixels;
    let pictures: HashSet<_> = names.iter().map(picture).collect();
    assert!(pictures.len() >= 8 * (1 + 6 + 2), "{}", pictures.len());
}
