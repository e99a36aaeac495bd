//! `trainer render`

use std::fs;
use std::path::Path;

use glimpse_evaluation::metrics::Metrics;
use glimpse_evaluation::render::Picture;
use serde_json::{Value, json};

use super::Folder;
use super::folder::PHONG_N8;
use super::shared::PHONG;

/// The metrics that `evaluate` and `render` report.
const METRICS: [&str; 5] = ["loss", "dssim", "l2", "psnr", "delta_e"];

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
    assert_eq!(printed.lines().count(), 4, "{printed}");
    let last = printed.lines().last().expect("a line");
    let place: Vec<&str> = last.split_whitespace().take(2).collect();
    assert_eq!(place, ["2", "1"], "{printed}");
    let size = size_of_png(&folder.at("all.png"));
    assert_eq!(size, [2 * 24 + 4, 2 * 24 + 4]);

    folder.succeed(&format!("{sphere} --out all.npy"));
    let array = folder.read("all.npy");
    let header = String::from_utf8_lossy(&array[..128]);
    assert!(header.contains("(52, 52, 3)"), "{header}");
    assert_eq!(array.len(), 128 + 4 * 52 * 52 * 3);
}

#[test]
fn printed_errors_match_pictures() {
    let folder = Folder::new();
    PHONG.copy_to(folder.path());
    let printed = folder.succeed(
        "render sphere procedural:3:5 --size 24 --columns 2 --recipe phong.recipe --out scans.png",
    );
    let sheet = pixels_of_png(&folder.at("scans.png"));
    let size = [2 * (2 * 24) + 4, 2 * 24 + 4];
    assert_eq!([sheet.width, sheet.height], size);
    for line in printed.lines().skip(1) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let place = |index: usize| words[index].parse::<usize>().expect("a number") - 1;
        let (row, column) = (place(0), place(1));
        let cell = |scan: usize| Picture {
            width: 24,
            height: 24,
            pixels: (0..24 * 24)
                .map(|pixel| {
                    let x = column * (2 * 24 + 4) + scan * 24 + pixel % 24;
                    sheet.pixels[(row * (24 + 4) + pixel / 24) * sheet.width + x]
                })
                .collect(),
        };
        let expected = Metrics::from_spheres(0.0, &cell(0), &cell(1)).expect("comparable pictures");
        let Metrics {
            dssim,
            l2,
            psnr,
            delta_e,
            ..
        } = expected;
        // The tolerance is half of the last printed digit.
        for (index, expected, last) in [
            (4, dssim, 1e-4),
            (5, l2, 1e-5),
            (6, psnr, 1e-2),
            (7, delta_e, 1e-2),
        ] {
            let printed: f64 = words[index].parse().expect("a number");
            assert!(
                (printed - expected).abs() < 0.51 * last,
                "{line}: {expected}"
            );
        }
    }
}

#[test]
fn plots_patterns() {
    let folder = Folder::new();
    PHONG.copy_to(folder.path());
    folder.succeed("render pattern phong.recipe --out p.svg");
    let svg = folder.read_text("p.svg");
    // Four samples, and one in the legend.
    let dots = svg.matches("class=\"dot\"").count();
    assert!(svg.starts_with("<svg") && dots == 4 + 1, "{svg}");
}

#[test]
fn rejects_invalid_arguments() {
    let folder = Folder::new();
    folder.write("bad.recipe", b"GLMQ");
    folder.write("file", b"in the way");
    folder.fail_each(
        "render",
        &[
            "sphere procedural:1 --recipe bad.recipe => bad.recipe",
            "sphere procedural:1 --out sphere.jpg => --out png",
            "sphere procedural:1 --out file/sphere.png => file/sphere.png",
            "sphere procedural:1 --size 0 => --size",
            "sphere procedural:1 --size 5000 => --size",
            "sphere procedural:1 --size 6 --recipe r.recipe => --size",
            "sphere procedural:1 --columns 0 => --columns",
            "pattern bad.recipe => bad.recipe",
        ],
    );
    assert_eq!(folder.names("").len(), 2, "a file was written");
}

#[test]
fn reports_json() {
    let folder = Folder::with("r.recipe", PHONG_N8);
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
        ("/spheres/2/scan", Value::Null),
    ] {
        assert_eq!(report.pointer(field), Some(&expected), "{field}");
    }

    // At the default size, the metrics equal those of `evaluate`.
    let report = run("sphere procedural:1:5 --recipe r.recipe", "scans.png");
    let evaluation = folder.succeed_as_json("evaluate --test procedural:1:5 --recipe r.recipe");
    for metric in METRICS {
        let metric_of_scan = &report["spheres"][0]["scan"][metric];
        assert!(metric_of_scan.is_number());
        assert_eq!(
            *metric_of_scan, evaluation["materials"][0][metric],
            "{metric}"
        );
    }
}
