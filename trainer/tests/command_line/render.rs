//! `trainer render`

use std::fs;
use std::path::Path;

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

    // The errors are those of the command that is made for them, in any light.
    fs::write(directory.join("grey.hdr"), panorama(8, 4)).expect("it is written");
    for light in [&[][..], &["--environment", "grey.hdr"]] {
        let scan = ["render", "sphere", "procedural:1:5", "--recipe"];
        let scan = [&scan[..], &["phong.recipe", "--size", "24"], light].concat();
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
            let [loss, dssim, l2, psnr] = ["loss", "dssim", "l2", "psnr"]
                .map(|metric| material[metric].as_f64().expect("a number"));
            let [loss, dssim] = [loss, dssim].map(|number| format!("{number:.4}"));
            let [l2, psnr] = [format!("{l2:.6}"), format!("{psnr:.2}")];
            assert_names(row.expect("a row"), &[&loss, &dssim, &l2, &psnr]);
        }
    }
    run(&["--recipe", "phong.recipe"]);
    assert_eq!(
        size_of_png(&directory.join("sphere.png")),
        (4 * 24 + 4, 2 * 24 + 4)
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
