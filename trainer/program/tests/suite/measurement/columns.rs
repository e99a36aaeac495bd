//! Columns and cells of files from people's work: each gives the right value, or an error that names the cause.

use glimpse_core::model::ModelKind;
use glimpse_fitting::measurement::{
    AngleArgs, AngleUnit, CountCalibration, Multiple, NamedRecipe, ReadingQuantity, ReadingRows,
    Readings, TableArgs, TableError,
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

fn parse(text: &str) -> Result<ReadingRows, TableError> {
    rows(text, &TableArgs::default())
}

fn read(text: &str) -> Result<[f32; 3], TableError> {
    let rows = parse(text)?;
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

/// Files with the same reading, with `|` at the ends of lines.
const READ: &str = "\
theta_i,theta_o,channel,value|45,0,R,0.104|45,9,R,1|45,0,G,0.047|45,9,G,1|45,0,b,0.025|45,9,B,1
theta_i,theta_o,channel,value|45,0,R,0.1|45,0,R,0.108|45,0,G,0.047|45,0,G,0.047|45,0,B,0.025|45,0,B,0.025
theta_in,theta_out,BRDF_R,BRDF_G,BRDF_B|45,0,0.104,0.047,0.025
# theta_in phi_in theta_out phi_out red green blue|45 0 0 180 0.104 0.047 0.025
theta_i,theta_o,R (%),G (%),B (%)|45,0,32.67,14.77,7.854
theta_i,theta_o,r,g,b,scatter|45,0,0.104,0.047,0.025,BRDF|45,0,9,9,9,BTDF
theta_i,theta_o,r,g,b,valid|45,0,0.104,0.047,0.025,1|45,0,9,9,9,no
theta_i,theta_o,r,g,b,flag|45,0,0.104,0.047,0.025,ok|45,0,9,9,9,Bad
theta_i,phi_i,theta_o,phi_o,r,g,b|45,0,0,0,0.104,0.047,0.025|45,0,120,180,9,9,9
theta_i,theta_o,r,g,b,humor|45,0,0.104,0.047,0.025,good|45,9,9,9,9,good
theta_i,theta_o,r,g,b,comment|45,0,0.104,0.047,0.025,a|45,9,9,9,9,b
theta_i;theta_o;r;g;b|45°;0°;0,104;0,047;0,025|45°;−30°;1.234,5;2;0,1
theta_i;theta_o;r;g;b|45;0;0.104;0.047;0.025|45;–30;1\u{202f}234.5;1'234;２
theta_i,theta_o,r,g,b|45,0,0.104,0.047,0.025|45,-30,n/a,--,NULL
instrument,theta_i,theta_o,r,g,b,value|,45,0,32.67,14.77,7.854,|gloss-60,,,,,,80|sci,,,30,14,7,|
theta_i,theta_o,CIE L*,CIE a*,CIE b*|45,0,49.594,15.678,23.289
theta_i (rad),theta_o (deg),r,g,b|0.785398,0,0.104,0.047,0.025
theta_i,theta_o,phi (rad),r,g,b|45,0,3.14159,0.104,0.047,0.025";

/// Words of an error, and the file after `=>` that is refused with it.
const REFUSED: &str = "\
gain --ignore --by => theta_i,theta_o,r,g,b,gain|45,0,1,1,1,1|45,9,1,1,1,2
sample --by => theta_i,theta_o,r,g,b,sample|45,0,1,1,1,a|45,9,1,1,1,b
instrument gonio gloss-60 45:0 multi-angle => theta_i,theta_o,r,g,b,instrument|45,0,1,1,1,gonio
gloss 2 value => instrument,r,g,b|gloss-60,1,2,3
gloss 3 value => instrument,value|gloss-20,0|gloss-60,-0.1
2 value => instrument,theta_i,theta_o,r,g,b,value|multi-angle,45,30,1,1,1,1
2 value => instrument,theta_i,theta_o,L*,a*,b*,value|sci,,,,,,50
3 angles => instrument,theta_i,theta_o,value|gloss-60,60,60,1|sci,45,30,1
2 directions => instrument,value|multi-angle,1
brdf-cos-o => instrument,value,quantity|sci,1,brdf-cos-o
spread_o 60 => theta_i,theta_o,value,spread_o|45,0,1,61
spread_o => instrument,theta_i,theta_o,value,spread_o|sci,,,1,6
quantity brdf reflectance-factor => theta_i,theta_o,L*,a*,b*,quantity|45,0,50,0,0,brdf
hue => theta_i,theta_o,hue,saturation,value|45,0,1,1,1
4 g => theta_i,theta_o,channel,value|45,0,R,1|45,0,G,1|45,9,R,1
3 wavelength 20 => theta_i,theta_o,wavelength,value|45,0,450,1|45,0,20,1
flag valid => theta_i,theta_o,r,g,b,flag|45,0,1,1,1,0|45,9,1,1,1,1
btdf => theta_i,theta_o,r,g,b,scatter|45,0,1,1,1,BTDF
horizon => theta_i,theta_o,r,g,b|45,120,1,1,1
--convention travel => theta_i,theta_o,r,g,b|135,20,1,1,1
--convention elevation => theta_i,theta_o,r,g,b|20,90,1,1,1
--unit => theta_h,theta_d,phi_d,value|0,0.5235988,0,1|0.3490659,0.1745329,1.5707963,1
--azimuth-unit => theta_i,theta_o,phi,r,g,b|45,20,3.14159,1,1,1
2 r 1.234 => theta_i;theta_o;r;g;b|45;0;1.234;2;3
counts/ms --white => theta_i,theta_o,r (counts/ms),g,b|45,0,1,1,1
1 20 theta_i => theta_o,20,30,45|0,1,1,1
1 theta_i => 45 0 1 1 1|45 9 1 1 1
ALTA 2 => #DIM 3 3|#PARAM_IN RUSIN_TH_TD_PD|0.1 0.9 -3 1 1 1
a b c d e => # a b c d e|45 0 1 1 1";

#[test]
fn reads_columns_and_cells() {
    for text in READ.lines().map(|line| line.replace('|', "\n")) {
        let mean = read(&text).unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_near(mean, RIGHT, &text);
    }
    let bands = "wavelength_nm,theta_i,theta_o,brdf\n450,45,0,0.1\n450,45,10,0.2\n550,45,0,0.1\n550,45,10,0.2\n";
    let rows = parse(bands).expect("the file is read");
    assert_eq!((rows.wavelengths.len(), rows.readings.len()), (2, 2));
    assert_eq!(rows.readings[1].numbers, [0.2, 0.2]);
}

#[test]
fn refuses_columns_and_cells_of_unknown_meaning() {
    for line in REFUSED.lines() {
        let (words, text) = line.split_once(" => ").expect("words of the error");
        let words: Vec<&str> = words.split(' ').collect();
        assert_names(&error_message(read(&text.replace('|', "\n"))), &words);
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
    assert!(all[0].summary.ignores("gain"));
    let mean = at_normal(all[0].clone(), ReadingQuantity::of(Multiple::Brdf));
    assert_near(mean.expect("readings"), RIGHT, text);
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
            white: parse(white)?,
            footprint: None,
        });
        at_normal(parse(text)?, quantity)
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
    let text = "theta_i,theta_o,phi,value\n45,30,180,1\n45,30,0,1\n";
    let rows = parse(text).expect("the file is read");
    let same = rows.reread(&rows.angle_args).expect("valid angles");
    let readings = rows.readings.iter();
    assert!(same.into_iter().eq(readings.map(|reading| reading.angles)));
    let radians = AngleArgs {
        unit: Some(AngleUnit::Radians),
        ..AngleArgs::default()
    };
    assert_eq!(rows.reread(&radians), None);
}
