//! Sheets of instruments: planned, filled in, fitted, and fitted again.

use super::Folder;

/// The displayed numbers, in the order of a sheet of paint-lab, without one reading.
const DISPLAYS: &str = ",,,52.1|,,,88.4|,,,96.5|32.1,14.5,8.3,|28.2,10.4,4.1,|61,44,38,|33,15,8,|31,13,7,|29,11,5,|,,,|28,11,5,";

#[test]
fn sheets_are_filled_in_fitted_and_fitted_again() {
    let folder = Folder::new();
    let plan = folder.succeed_as_json("plan --geometry paint-lab --blank sheet.csv");
    assert_eq!(plan["readings"][1]["unit"], "gloss-units");
    assert_eq!(plan["readings"][5]["aspecular"], -15.0);
    let sheet = folder.read_text("sheet.csv");
    let (header, rows) = sheet.split_once('\n').expect("names");
    let mut filled = format!("{header}\n");
    for (row, display) in rows.lines().zip(DISPLAYS.split('|')) {
        filled += &format!("{}{display}\n", row.strip_suffix(",,,").expect("a blank"));
    }
    folder.write("filled.csv", filled);
    let options = "--accept-implausible --keep-all --out";
    let fit =
        |file: &str, out: &str| folder.succeed_as_json(&format!("fit {file} {options} {out}"));
    let report = fit("--measurements filled.csv", "one");
    assert_eq!(report[0]["measured"]["quantity"], "reflectance-percent");
    assert_eq!(report[0]["readings"]["used"], 10);
    assert_eq!(report[0]["gaps"]["is_width_unknown"], false);
    fit("--measurements one/readings.csv", "two");
    for name in ["value", "fitted_r", "fitted_b"] {
        let column = |fit: &str| folder.column(&format!("{fit}/readings.csv"), name);
        for (one, two) in column("one").iter().zip(column("two")) {
            let [one, two] = [one, &two].map(|cell| cell.parse::<f64>().unwrap_or_default());
            assert!((one - two).abs() <= 1e-3 * one, "{name}: {one} {two}");
        }
    }
    // A sphere alone reads no width, and an own pattern has no aperture.
    folder.write("sphere.csv", "instrument,r,g,b\nsci,32,12,6\nsce,28,8,2\n");
    let report = fit("--measurements sphere.csv", "sphere");
    assert_eq!(report[0]["gaps"]["is_width_unknown"], true);
    let report = fit("neural-n8 --measurements filled.csv", "own");
    assert_eq!(report[0]["recipe"]["file"], "neural-any");

    let lab = "theta_i,theta_o,L*,a*,b*\n45,0,50,15,20\n45,30,55,15,20\n";
    folder.write("lab.csv", lab);
    let report = fit("--measurements lab.csv --illuminant a", "lab");
    let viewing = &report[0]["measured"]["cielab"];
    assert_eq!([&viewing["illuminant"], &viewing["observer"]], ["a", "10"]);
    folder.fail_each(
        "",
        &[
            "plan --geometry gloss-60 --speed 5 => --geometry",
            "plan --geometry paint-lab --out route.csv => --out",
            "plan neural-n8 --geometry sci => --geometry neural-n8",
            "export linear-any --geometry sci --format postcard --out x => --geometry",
            "render pattern linear-any --geometry gloss-20,in-plane => --geometry",
        ],
    );
}
