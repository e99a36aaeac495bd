//! `trainer render`

use std::fs;
use std::path::Path;

use glimpse_trainer::metrics::Scores;
use glimpse_trainer::render::Picture;
use serde_json::{Value, json};

use super::common::assert_names;
use super::shared::PHONG;
use super::{fail, succeed, succeed_as_json};

/// Width and height of a PNG file.
fn size_of_png(path: &Path) -> (u32, u32) {
    let file = fs::File::open(path).expect("it is there");
    let reader = png::Decoder::new(std::io::BufReader::new(file)).read_info();
    let reader = reader.expect("it is a PNG file");
    (reader.info().width, reader.info().height)
}

/// The words of each line of a table but its first.
fn numbers(text: &str) -> Vec<Vec<String>> {
    let words = |line: &str| line.split_whitespace().map(str::to_owned).collect();
    text.lines().skip(1).map(words).collect()
}

/// The pixels of a PNG file.
fn pixels_of_png(path: &Path) -> Picture {
    let file = fs::File::open(path).expect("it is there");
    let reader = png::Decoder::new(std::io::BufReader::new(file)).read_info();
    let mut reader = reader.expect("it is a PNG file");
    let mut bytes = vec![0; reader.output_buffer_size().expect("it has a size")];
    let info = reader.next_frame(&mut bytes).expect("it is whole");
    Picture {
        width: info.width as usize,
        height: info.height as usize,
        pixels: bytes.as_chunks().0.to_vec(),
    }
}

/// A grey panorama, as a Radiance file without compression.
fn panorama(width: u8, height: u8) -> Vec<u8> {
    let mut file = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n".to_vec();
    file.extend(format!("-Y {height} +X {width}\n").bytes());
    for _ in 0..u32::from(width) * u32::from(height) {
        file.extend([128, 128, 128, 128]);
    }
    file
}

#[test]
fn spheres_are_rendered_in_a_grid_or_on_a_page() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let sphere = [
        "render",
        "sphere",
        "procedural:3:5",
        "--size",
        "24",
        "--columns",
        "2",
    ];
    let run = |more: &[&str]| succeed(directory, &[&sphere, more].concat());

    let printed = run(&["--out", "all.png"]);
    assert_eq!(printed.lines().count(), 4, "{printed}");
    let last: Vec<&str> = printed
        .lines()
        .last()
        .expect("a line")
        .split_whitespace()
        .collect();
    assert_eq!(last[..2], ["2", "1"], "{printed}");
    assert_eq!(
        size_of_png(&directory.join("all.png")),
        (2 * 24 + 4, 2 * 24 + 4)
    );

    run(&["--out", "all.exr"]);
    let file = fs::read(directory.join("all.exr")).expect("it is there");
    assert_eq!(
        file[..4],
        [0x76, 0x2f, 0x31, 0x01],
        "OpenEXR's magic number"
    );

    PHONG.copy_to(directory);
    // A page of scans has a row for each material.
    let page = "render sphere procedural:2:5 --size 24 --out scans.html --recipe phong.recipe";
    succeed(directory, &page.split(' ').collect::<Vec<_>>());
    let html = fs::read_to_string(directory.join("scans.html")).expect("it is there");
    assert_eq!(html.matches("<img").count(), 4);
    assert!(!html.contains('`'), "markup of another kind: {html}");
    let pictures = fs::read_dir(directory.join("scans-pictures")).expect("it is there");
    for picture in pictures {
        let path = picture.expect("it is there").path();
        assert_eq!(size_of_png(&path), (24, 24));
        let name = path
            .file_name()
            .expect("a name")
            .to_string_lossy()
            .into_owned();
        assert!(html.contains(&name), "{name}");
    }

    // The errors belong to the pictures that are written.
    let printed = run(&["--recipe", "phong.recipe", "--out", "scans.png"]);
    let sheet = pixels_of_png(&directory.join("scans.png"));
    for line in numbers(&printed) {
        let place = |index: usize| line[index].parse::<usize>().expect("a number") - 1;
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
        let expected = Scores::of_spheres(0.0, &cell(0), &cell(1)).expect("they can be compared");
        let found = [4, 5, 6, 7].map(|index| line[index].parse::<f64>().expect("a number"));
        let Scores {
            dssim,
            l2,
            psnr,
            delta_e,
            ..
        } = expected;
        let rounding = [1e-4, 1e-6, 1e-2, 1e-4].map(|last| 0.51 * last);
        let errors = found.into_iter().zip([dssim, l2, psnr, delta_e]);
        for ((found, expected), rounding) in errors.zip(rounding) {
            assert!((found - expected).abs() < rounding, "{line:?} {expected:?}");
        }
    }

    // Of the size of evaluate's pictures, they are those of evaluate, in any light.
    fs::write(directory.join("grey.hdr"), panorama(8, 4)).expect("it is written");
    for light in [&[][..], &["--environment", "grey.hdr"]] {
        let scan = ["render", "sphere", "procedural:1:5", "--recipe"];
        let scan = [&scan[..], &["phong.recipe"], light].concat();
        let printed = succeed(directory, &scan);
        let judge = [
            "evaluate",
            "--recipe",
            "phong.recipe",
            "--test",
            "procedural:1:5",
            "--json",
        ];
        let judged = succeed_as_json(directory, &[&judge, light].concat());
        for material in judged["materials"].as_array().expect("a list") {
            let name = material["name"].as_str().expect("a name");
            let row = printed.lines().find(|line| line.contains(name));
            let [loss, dssim, l2, psnr, delta_e] = ["loss", "dssim", "l2", "psnr", "delta_e"]
                .map(|metric| material[metric].as_f64().expect("a number"));
            let [loss, dssim] = [loss, dssim].map(|number| format!("{number:.4}"));
            let [l2, psnr] = [format!("{l2:.6}"), format!("{psnr:.2}")];
            let delta_e = format!("{delta_e:.4}");
            assert_names(row.expect("a row"), &[&loss, &dssim, &l2, &psnr, &delta_e]);
        }
    }
    run(&["--recipe", "phong.recipe"]);
    assert_eq!(
        size_of_png(&directory.join("scans.png")),
        (2 * (2 * 24) + 4, 2 * 24 + 4)
    );
}

#[test]
fn lobes_and_patterns_are_drawn() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    PHONG.copy_to(directory);
    succeed(
        directory,
        &["render", "pattern", "phong.recipe", "--out", "p.svg"],
    );
    let svg = fs::read_to_string(directory.join("p.svg")).expect("it is there");
    // Four samples, and the legend.
    let dots = svg.matches("class=\"dot\"").count();
    assert!(svg.starts_with("<svg") && dots == 4 + 1, "{svg}");
    let lobe = [
        "render",
        "lobe",
        "procedural:1",
        "--theta-i",
        "30,60",
        "--recipe",
        "phong.recipe",
    ];
    succeed(directory, &lobe);
    let svg = fs::read_to_string(directory.join("lobe.svg")).expect("it is there");
    // Each of four curves is in the legend too.
    assert_eq!(svg.matches("class=\"curve").count(), 8, "{svg}");
    assert_eq!(svg.matches("class=\"curve dash\"").count(), 4);
}

#[test]
fn what_cannot_be_drawn_is_refused_at_once() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let write = |name, bytes: &[u8]| fs::write(directory.join(name), bytes).expect("it is written");
    write("square.hdr", &panorama(8, 8));
    write("cut.hdr", &panorama(8, 4)[..60]);
    write("not.exr", b"no picture");
    write("bad.recipe", b"GLMQ");
    write("file", b"in the way");
    let sphere = ["render", "sphere", "procedural:1"];
    let lobe = ["render", "lobe", "procedural:1"];
    for (command, more, named) in [
        (
            &sphere,
            &["--environment", "square.hdr"][..],
            &["square.hdr", "2:1"][..],
        ),
        (&sphere, &["--environment", "cut.hdr"], &["cut.hdr"]),
        (&sphere, &["--environment", "not.exr"], &["not.exr"]),
        (&sphere, &["--environment", "none.exr"], &["none.exr"]),
        (&sphere, &["--recipe", "bad.recipe"], &["bad.recipe"]),
        (&sphere, &["--out", "sphere.jpg"], &["--out", "png"]),
        (&sphere, &["--out", "file/sphere.png"], &["file/sphere.png"]),
        (&sphere, &["--size", "0"], &["--size"]),
        (&sphere, &["--size", "5000"], &["--size"]),
        (
            &sphere,
            &["--size", "6", "--recipe", "r.recipe"],
            &["--size"],
        ),
        (&sphere, &["--columns", "0"], &["--columns"]),
        (&lobe, &["--theta-i", "90"], &["--theta-i"]),
        (&lobe, &["--theta-i", "0,10,20,30,40,50,60"], &["7"]),
        (&lobe, &["--out", "lobe.png"], &["lobe.png", "svg"]),
        (&lobe, &["--out", "file/lobe.svg"], &["file/lobe.svg"]),
        (&["render", "pattern", "bad.recipe"], &[], &["bad.recipe"]),
    ] {
        assert_names(&fail(directory, &[command, more].concat()), named);
    }
    let names = fs::read_dir(directory).expect("it can be listed");
    assert_eq!(names.count(), 5, "nothing was written");
}

#[test]
fn what_was_drawn_is_reported_as_json() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let directory = scratch.path();
    let recipe = include_bytes!("../../../core/examples/recipes/phong-n8.recipe");
    fs::write(directory.join("r.recipe"), recipe).expect("it is written");
    // A grey light that is brighter than the studio's.
    fs::write(directory.join("grey.hdr"), panorama(8, 4)).expect("it is written");
    let run = |arguments: &[&str], out: &str| -> Value {
        let arguments = [&["render"], arguments, &["--json", "--out", out]].concat();
        let told = succeed(directory, &arguments);
        let told: Value = serde_json::from_str(&told).expect("it is JSON");
        let size = fs::metadata(directory.join(out)).expect("it is there");
        assert_eq!(told["file"], json!({ "path": out, "bytes": size.len() }));
        told
    };
    let sphere = ["sphere", "procedural:3:5", "--size", "24", "--columns", "2"];
    let told = run(&sphere, "s.png");
    let size = size_of_png(&directory.join("s.png"));
    assert_eq!(
        json!([told["width"], told["height"]]),
        json!([size.0, size.1])
    );
    assert_eq!(
        (&told["sphere_pixels"], &told["exposure"]),
        (&24.into(), &1.0.into())
    );
    let last = &told["spheres"][2];
    assert_eq!(
        json!([last["row"], last["column"], last["scan"]]),
        json!([2, 1, null])
    );

    // The default size is that of the metrics.
    let sphere = ["sphere", "procedural:3:5"];
    let light = ["--environment", "grey.hdr", "--recipe", "r.recipe"];
    let told = run(&[&sphere[..], &light].concat(), "scans.png");
    assert_eq!(told["environment"], "grey.hdr");
    let exposure = told["exposure"].as_f64().expect("a number");
    assert!(exposure > 0.0 && exposure != 1.0, "{exposure}");
    let judge = [
        "evaluate",
        "--recipe",
        "r.recipe",
        "--test",
        "procedural:3:5",
    ];
    let judged = succeed(directory, &[&judge[..], &light[..2], &["--json"]].concat());
    let judged: Value = serde_json::from_str(&judged).expect("it is JSON");
    for index in 0..3 {
        let (scan, material) = (&told["spheres"][index]["scan"], &judged["materials"][index]);
        for metric in ["loss", "dssim", "l2", "psnr", "delta_e"] {
            assert!(scan[metric].is_number());
            assert_eq!(scan[metric], material[metric], "{metric}");
        }
    }
    let told = run(&["sphere", "procedural:2", "--size", "24"], "page.html");
    assert_eq!(
        (&told["width"], &told["sphere_pixels"]),
        (&Value::Null, &24.into())
    );

    let lobe = [
        "lobe",
        "procedural:1",
        "--theta-i",
        "30,60",
        "--recipe",
        "r.recipe",
    ];
    let told = run(&lobe, "l.svg");
    let curve = |degrees: f64| {
        let material = "procedural-000-metal";
        json!({ "material": material, "theta_i_degrees": degrees, "scanned": true })
    };
    assert_eq!(told["curves"], json!([curve(30.0), curve(60.0)]));

    let told = run(&["pattern", "r.recipe"], "p.svg");
    assert_eq!(
        (&told["model"], &told["samples"]),
        (&"phong".into(), &8.into())
    );

    let told = run(
        &["view", "r.recipe", "--material", "procedural:1"],
        "v.html",
    );
    assert_eq!(
        told["recipes"],
        json!([{ "name": "r", "model": "phong", "samples": 8, "readings": 8 }])
    );
    assert!(
        told["reference_table_loss"]
            .as_f64()
            .is_some_and(|loss| loss < 0.01)
    );
}
