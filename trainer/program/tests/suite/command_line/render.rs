//! `trainer render`

use std::fs;
use std::path::Path;

use glimpse_evaluation::render::Picture;
use serde_json::json;

use super::Folder;
use super::shared::PHONG;

/// The pixels of a PNG file.
pub(super) fn pixels_of_png(path: &Path) -> Picture {
    let file = fs::File::open(path).expect("the file exists");
    let reader = png::Decoder::new(std::io::BufReader::new(file)).read_info();
    let mut reader = reader.expect("a PNG file");
    let mut bytes = vec![0; reader.output_buffer_size().expect("a buffer size")];
    let info = reader.next_frame(&mut bytes).expect("a valid recipe");
    Picture {
        width: info.width as usize,
        height: info.height as usize,
        pixels: bytes.as_chunks().0.to_vec(),
    }
}

#[test]
fn renders_grid() {
    let folder = Folder::new();
    let sphere = "render sphere procedural:3:5 --size 24 --columns 2";
    let report = folder.succeed_as_json(&format!("{sphere} --out all.png"));
    let picture = pixels_of_png(&folder.at("all.png"));
    assert_eq!([picture.width, picture.height], [2 * 24 + 4; 2]);
    let file = json!({ "path": "all.png", "bytes": folder.read("all.png").len() });
    for (field, expected) in [
        ("/file", file),
        ("/width", json!(52)),
        ("/height", json!(52)),
        ("/sphere_pixels", json!(24)),
        ("/spheres/2/row", json!(2)),
        ("/spheres/2/column", json!(1)),
    ] {
        assert_eq!(report.pointer(field), Some(&expected), "{field}");
    }

    folder.succeed(&format!("{sphere} --out all.npy"));
    let array = folder.read("all.npy");
    let header = String::from_utf8_lossy(&array[..128]);
    assert!(header.contains("(52, 52, 3)"), "{header}");
    assert_eq!(array.len(), 128 + 4 * 52 * 52 * 3);
}

#[test]
fn renders_photographs() {
    let folder = Folder::new();
    folder.write(
        "lamps.csv",
        "picture,x,y,z\na.png,0,0,2\nb.png,-0.6,0,-0.8\n",
    );
    let command = "render sphere procedural:1:3 --size 32";
    let report = folder.succeed_as_json(&format!("{command} --lights lamps.csv --out set"));
    assert_eq!(report["circle"], json!([15.5, 15.5, 15.36]));
    for (name, is_in_front) in [("set/a.png", true), ("set/b.png", false)] {
        let picture = glimpse_program::picture::read(&folder.at(name)).expect("a linear picture");
        let brightest = picture
            .pixels
            .as_flattened()
            .iter()
            .copied()
            .fold(0.0, f32::max);
        assert!((brightest - 0.9).abs() < 1e-4, "{brightest}");
        // The light behind the ball is at the left.
        let row = &picture.pixels[16 * 32..17 * 32];
        let is_lit = |pixels: &[[f32; 3]]| pixels.iter().any(|pixel| pixel[0] > 0.0);
        assert_eq!([is_lit(&row[..4]), is_lit(&row[8..])], [true, is_in_front]);
    }
    // With its own lights, it is the same set.
    folder.succeed(&format!("{command} --lights set/lights.csv --out again"));
    for name in folder.names("set") {
        let [own, again] = ["set", "again"].map(|set| folder.read(&format!("{set}/{name}")));
        assert!(own == again, "{name}");
    }
    folder.write("bad.csv", "picture,x,y,z\na.tif,0,0,1\n");
    folder.fail_each(
        "render sphere",
        &[
            "procedural:1 --lights bad.csv --out bad => bad.csv png",
            "procedural:1 --lights lamps.csv => --out folder",
            "procedural:1 --lights lamps.csv --out set --columns 2 => --lights --columns",
            "procedural:2 --lights lamps.csv --out two => procedural:2",
            "procedural:1 --lights set/lights.csv --out set --force => lights.csv input",
        ],
    );
}

#[test]
fn plots_patterns() {
    let folder = Folder::new();
    PHONG.copy_to(folder.path());
    folder.succeed("render pattern phong.recipe --out p.svg");
    let svg = folder.read_text("p.svg");
    // Four samples, and one in the legend.
    for mark in ["<circle class=\"mark", "<rect class=\"mark"] {
        let marks = svg.matches(mark).count();
        assert!(svg.starts_with("<svg") && marks == 4 + 1, "{svg}");
    }
}

#[test]
fn rejects_invalid_arguments() {
    let folder = Folder::new();
    folder.write("bad.recipe", b"GLMQ");
    folder.write("file", b"in the way");
    folder.fail_each(
        "render",
        &[
            "sphere procedural:1 --out sphere.jpg => --out png",
            "sphere procedural:1 --out file/sphere.png => file/sphere.png",
            "sphere procedural:1 --size 0 => --size",
            "sphere procedural:1 --size 5000 => --size",
            "sphere procedural:1 --columns 0 => --columns",
            "pattern bad.recipe => bad.recipe",
        ],
    );
    assert_eq!(folder.names("").len(), 2, "a file was written");
}
