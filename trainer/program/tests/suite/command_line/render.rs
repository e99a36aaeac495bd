//! `trainer render`

use std::fs;
use std::path::Path;

use glimpse_evaluation::render::Picture;
use serde_json::{Value, json};

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

/// Width and height of a PNG file.
fn size_of_png(path: &Path) -> [usize; 2] {
    let picture = pixels_of_png(path);
    [picture.width, picture.height]
}

#[test]
fn renders_grid() {
    let folder = Folder::new();
    let sphere = "render sphere procedural:3:5 --size 24 --columns 2";

    let printed = folder.succeed(&format!("{sphere} --out all.png"));
    let last = printed.lines().last().expect("a line");
    let place: Vec<&str> = last.split('|').map(str::trim).take(3).collect();
    assert_eq!(place, ["", "2", "1"], "{printed}");
    let size = size_of_png(&folder.at("all.png"));
    assert_eq!(size, [2 * 24 + 4, 2 * 24 + 4]);

    folder.succeed(&format!("{sphere} --out all.npy"));
    let array = folder.read("all.npy");
    let header = String::from_utf8_lossy(&array[..128]);
    assert!(header.contains("(52, 52, 3)"), "{header}");
    assert_eq!(array.len(), 128 + 4 * 52 * 52 * 3);
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

#[test]
fn reports_json() {
    let folder = Folder::new();
    let run = |command: &str, out: &str| -> Value {
        let report = folder.succeed_as_json(&format!("render {command} --out {out}"));
        let bytes = folder.read(out).len();
        assert_eq!(report["file"], json!({ "path": out, "bytes": bytes }));
        report
    };
    let report = run("sphere procedural:3:5 --size 24 --columns 2", "s.png");
    let [width, height] = size_of_png(&folder.at("s.png"));
    for (field, expected) in [
        ("/width", json!(width)),
        ("/height", json!(height)),
        ("/sphere_pixels", json!(24)),
        ("/spheres/2/row", json!(2)),
        ("/spheres/2/column", json!(1)),
    ] {
        assert_eq!(report.pointer(field), Some(&expected), "{field}");
    }
}
