//! Columns and cells of files from people's work: each gives the right value, or an error that names the cause.

use glimpse_core::model::ModelKind;
use glimpse_fitting::measurement::{
    AngleArgs, CountCalibration, LeftOutRow, Multiple, NamedRecipe, ReadingQuantity, ReadingRows,
    Readings, Role, TableArgs, TableError,
};
use glimpse_fitting::route::arms_in_degrees;

use super::{error_message, rows};
use crate::common::assert_names;

/// The reading at theta_i = 45, theta_o = 0 degrees.
const RIGHT: [f32; 3] = [0.104, 0.047, 0.025];

/// Returns the means of readings at theta_i = 45 degrees along the normal.
fn at_normal(rows: ReadingRows, quantity: ReadingQuantity) -> Result<[f32; 3], TableError> {
    let readings = Readings::new(&NamedRecipe::any(ModelKind::Linear), rows, quantity)?;
    let sample = readings.samples.iter().find(|sample| {
        let arms = arms_in_degrees(sample.angles);
        (arms.theta_i - 45.0).abs() < 0.01 && arms.theta_o < 0.01
    });
    Ok(sample
        .and_then(|sample| sample.brdf.mean())
        .expect("a reading"))
}

fn read(text: &str) -> Result<[f32; 3], TableError> {
    let rows = rows(text, &TableArgs::default())?;
    let quantity = ReadingQuantity::of_values(None, None, &rows).expect("a quantity");
    at_normal(rows, quantity)
}

/// Asserts that a mean is within 1 % of the expected one.
fn assert_near(mean: [f32; 3], expected: [f32; 3], text: &str) {
    let mut pairs = mean.into_iter().zip(expected);
    assert!(
        pairs.all(|(mean, expected)| (mean / expected - 1.0).abs() < 0.01),
        "{text}: {mean:?}"
    );
}

#[test]
fn reads_columns_and_cells() {
    let long = "theta_i,theta_o,channel,value\n45,0,R,0.104\n45,30,R,1\n45,0,G,0.047\n45,30,G,1\n45,0,b,0.025\n45,30,B,1\n";
    let repeated = "theta_i,theta_o,channel,value\n45,0,R,0.1\n45,0,R,0.108\n45,0,G,0.047\n45,0,G,0.047\n45,0,B,0.025\n45,0,B,0.025\n";
    for text in [
        long,
        repeated,
        "theta_in,theta_out,BRDF_R,BRDF_G,BRDF_B\n45,0,0.104,0.047,0.025\n",
        "# theta_in phi_in theta_out phi_out red green blue\n45 0 0 180 0.104 0.047 0.025\n",
        "theta_i,theta_o,R (%),G (%),B (%)\n45,0,32.67,14.77,7.854\n",
        "theta_i,theta_o,r,g,b,scatter\n45,0,0.104,0.047,0.025,BRDF\n45,0,9,9,9,BTDF\n",
        "theta_i,theta_o,r,g,b,valid\n45,0,0.104,0.047,0.025,1\n45,0,9,9,9,no\n",
        "theta_i,theta_o,r,g,b,flag\n45,0,0.104,0.047,0.025,ok\n45,0,9,9,9,Bad\n",
        "theta_i,phi_i,theta_o,phi_o,r,g,b\n45,0,0,0,0.104,0.047,0.025\n45,0,120,180,9,9,9\n",
        "theta_i,theta_o,r,g,b,humor\n45,0,0.104,0.047,0.025,good\n45,10,9,9,9,good\n",
        "theta_i,theta_o,r,g,b,comment\n45,0,0.104,0.047,0.025,a\n45,10,9,9,9,b\n",
        "theta_i;theta_o;r;g;b\n45°;0°;0,104;0,047;0,025\n45°;\u{2212}30°;1.234,5;n/a;0,1\n"
            .replace("n/a", "2")
            .as_str(),
        "theta_i;theta_o;r;g;b\n45;0;0.104;0.047;0.025\n45;–30;1\u{202f}234.5;1'234;２\n",
        "theta_i,theta_o,r,g,b\n45,0,0.104,0.047,0.025\n45,-30,n/a,--,NULL\n",
        "theta_i (rad),theta_o (deg),r,g,b\n0.785398,0,0.104,0.047,0.025\n",
        "theta_i,theta_o,phi (rad),r,g,b\n45,0,3.14159,0.104,0.047,0.025\n",
    ] {
        let mean = read(text).unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_near(mean, RIGHT, text);
    }
    let bands = "wavelength_nm,theta_i,theta_o,brdf\n450,45,0,0.1\n450,45,10,0.2\n550,45,0,0.1\n550,45,10,0.2\n";
    let rows = rows(bands, &TableArgs::default()).expect("the file is read");
    assert_eq!((rows.wavelengths.len(), rows.readings.len()), (2, 2));
    assert_eq!(rows.readings[1].numbers, [0.2, 0.2]);
}

#[test]
fn refuses_columns_and_cells_of_unknown_meaning() {
    for (text, words) in [
        (
            "theta_i,theta_o,r,g,b,gain\n45,0,1,1,1,1\n45,9,1,1,1,2\n",
            &["gain", "--ignore", "--by"][..],
        ),
        (
            "theta_i,theta_o,r,g,b,sample\n45,0,1,1,1,a\n45,9,1,1,1,b\n",
            &["sample", "--by"],
        ),
        (
            "theta_i,theta_o,r,g,b,instrument\n45,0,1,1,1,a\n",
            &["instrument", "supported"],
        ),
        (
            "theta_i,theta_o,hue,saturation,value\n45,0,1,1,1\n",
            &["hue"],
        ),
        ("theta_i,theta_o,L,a,b\n45,0,1,1,1\n", &["l", "color"]),
        (
            "theta_i,theta_o,channel,value\n45,0,R,1\n45,0,G,1\n45,9,R,1\n",
            &["4", "g"],
        ),
        (
            "theta_i,theta_o,wavelength,value\n45,0,450,1\n45,0,20,1\n",
            &["3", "wavelength", "20"],
        ),
        (
            "theta_i,theta_o,r,g,b,flag\n45,0,1,1,1,0\n45,9,1,1,1,1\n",
            &["flag", "valid"],
        ),
        (
            "theta_i,theta_o,r,g,b,scatter\n45,0,1,1,1,BTDF\n",
            &["2", "btdf"],
        ),
        ("theta_i,theta_o,r,g,b\n45,120,1,1,1\n", &["2", "horizon"]),
        (
            "theta_i,theta_o,r,g,b\n135,20,1,1,1\n",
            &["--convention", "travel"],
        ),
        (
            "theta_i,theta_o,phi,r,g,b\n45,20,3.14159,1,1,1\n",
            &["--azimuth-unit"],
        ),
        (
            "theta_i;theta_o;r;g;b\n45;0;1.234;2;3\n",
            &["2", "r", "1.234"],
        ),
        (
            "theta_i,theta_o,r (counts/ms),g,b\n45,0,1,1,1\n",
            &["counts/ms", "--white"],
        ),
        ("theta_o,20,30,45\n0,1,1,1\n", &["1", "20", "theta_i"]),
        ("45 0 1 1 1\n45 9 1 1 1\n", &["1", "theta_i"]),
        (
            "#DIM 3 3\n#PARAM_IN RUSIN_TH_TD_PD\n0.1 0.9 -3 1 1 1\n",
            &["ALTA", "2"],
        ),
        ("# a b c d e\n45 0 1 1 1\n", &["# a b c d e"]),
    ] {
        assert_names(&error_message(read(text)), words);
    }
}

#[test]
fn options_ignore_columns_and_split_files() {
    let text = "theta_i,theta_o,r,g,b,gain,Sample Name\n45,0,0.104,0.047,0.025,1,a/b\n45,0,0.2,0.2,0.2,2,c\n";
    let args = TableArgs {
        ignore: vec!["Gain".to_owned()],
        ..TableArgs::default()
    };
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let path = scratch.path().join("a.csv");
    std::fs::write(&path, text).expect("the file is written");
    let all = ReadingRows::read_by(&path, &args, "sample_name").expect("the file is read");
    let names: Vec<&str> = all.iter().map(|rows| &rows.name[..]).collect();
    assert_eq!(names, ["a_b", "c"]);
    assert_eq!(all[0].summary.of(Role::Ignored).count(), 1);
    let quantity = ReadingQuantity::of(Multiple::Brdf);
    assert_near(
        at_normal(all[0].clone(), quantity).expect("readings"),
        RIGHT,
        text,
    );
    let refused = ReadingRows::read_by(&path, &args, "batch").map(|_| ());
    assert_names(&error_message(refused), &["batch", "--by"]);
}

#[test]
fn exposures_scale_counts() {
    let white = "theta_i,theta_o,exposure_ms,value\n45,0,10,4000\n45,30,10,4000\n";
    let counts = |text: &str, white: &str| {
        let quantity = ReadingQuantity::Counts(CountCalibration {
            dark: Some([100.0; 3]),
            reflectance: Some([1.0; 3]),
            saturation: Some(9_000.0),
            white: rows(white, &TableArgs::default())?,
            footprint: None,
        });
        let rows = rows(text, &TableArgs::default())?;
        let left_out = rows.summary.left_out.iter();
        assert!(
            left_out
                .clone()
                .all(|out| out.reason == LeftOutRow::Invalid)
        );
        at_normal(rows, quantity)
    };
    // 3900 counts above dark in 10 ms are 1 / pi.
    let text = "theta_i,theta_o,exposure (s),value\n45,0,0.05,6471\n45,30,0.1,200\n";
    let mean = counts(text, white).expect("readings");
    assert_near(mean, [0.104; 3], text);
    let without = "theta_i,theta_o,value\n45,0,4000\n45,30,4000\n";
    for (text, white) in [(text, without), (without, white)] {
        assert_names(&error_message(counts(text, white)), &["exposure"]);
    }
}

#[test]
fn rereads_by_other_conventions() {
    let rows = rows(
        "theta_i,theta_o,phi,value\n45,30,180,1\n45,30,0,1\n",
        &TableArgs::default(),
    );
    let rows = rows.expect("the file is read");
    let same = rows.reread(&rows.angle_args).expect("valid angles");
    let angles: Vec<_> = rows.readings.iter().map(|reading| reading.angles).collect();
    assert_eq!(same, angles);
    let radians = AngleArgs {
        unit: Some(glimpse_fitting::measurement::AngleUnit::Radians),
        ..AngleArgs::default()
    };
    assert_eq!(rows.reread(&radians), None);
}
