//! Quantities of readings, and counts relative to a white tile.

use std::f32::consts::PI;
use std::fs;

use glimpse_core::geometry::HalfDifference;
use glimpse_core::gonio::Footprint;
use glimpse_fitting::measurement::{
    AngleArgs, CountCalibration, ReadingQuantity, TableError, WhiteReference,
};

use super::{error_message, pattern, read_readings};
use crate::common::assert_names;

const BRDF: f32 = 0.25;

/// The cosines of light and sensor at a sample.
fn cosines(sample: usize) -> [f32; 2] {
    let at = HalfDifference::from_angles(pattern()[sample]);
    [at.cos_theta_i(), at.cos_theta_o()]
}

/// Asserts that a reading is [`BRDF`] in all channels.
fn assert_is_brdf(reading: Option<[f32; 3]>) {
    let reading = reading.expect("a reading");
    assert!(
        reading.iter().all(|f| (f / BRDF - 1.0).abs() < 1e-4),
        "{reading:?}"
    );
}

/// Returns the error message about an invalid white file.
fn white_error(text: &str, footprint: Option<Footprint>) -> String {
    match white(text, footprint) {
        Err(TableError::Damaged { message, .. } | TableError::OffPattern { message, .. }) => {
            message
        }
        Err(error) => panic!("{error}"),
        Ok(_) => panic!("the file is accepted"),
    }
}

fn white(text: &str, footprint: Option<Footprint>) -> Result<ReadingQuantity, TableError> {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let path = scratch.path().join("white.csv");
    fs::write(&path, text).expect("the file is written");
    let white = WhiteReference::read(&path, &AngleArgs::default(), &pattern(), footprint);
    Ok(ReadingQuantity::Counts(CountCalibration {
        dark: [100.0; 3],
        reflectance: [0.5; 3],
        saturation: Some(4_000.0),
        white: white?,
    }))
}

#[test]
fn converts_counts_with_white() {
    // At the same directions the cosines cancel: 1000 counts above dark correspond to 0.5 / pi.
    let counts = |white: f32| 100.0 + BRDF * PI / 0.5 * (white - 100.0);
    let quantity = white("index,value\n2,2100\n0,1000\n0,1200\n", None).expect("the file is read");
    let text = format!(
        "index,value\n0,{}\n2,{}\n",
        counts(1_100.0),
        counts(2_100.0)
    );
    let read = read_readings(&text, &quantity).expect("the file is read");
    for sample in [0, 2] {
        assert_is_brdf(read.samples[sample].mean());
    }
    let message = error_message(read_readings("index,value\n1,500\n", &quantity));
    assert_names(&message, &["2", "1"]);
    let saturated = read_readings("index,value\n0,4000\n", &quantity).expect("the file is read");
    assert!(saturated.samples[0].saturated());

    // With a single reading at normal incidence, one cosine remains.
    let single_row = "theta_i,phi_i,theta_o,phi_o,value\n0,0,0,0,1100\n";
    for (footprint, arm) in [(Footprint::LightLarger, 0), (Footprint::SensorLarger, 1)] {
        let quantity = white(single_row, Some(footprint)).expect("the file is read");
        let cosine = cosines(2)[arm];
        let text = format!(
            "index,value\n2,{}\n",
            100.0 + cosine * (counts(1_100.0) - 100.0)
        );
        assert_is_brdf(
            read_readings(&text, &quantity)
                .expect("the file is read")
                .samples[2]
                .mean(),
        );
    }
    assert_names(
        &white_error(single_row, None),
        &["--footprint", "light", "sensor"],
    );
    let two_rows = "index,value\n0,1100\n1,1100\n";
    let message = white_error(two_rows, Some(Footprint::LightLarger));
    assert_names(&message, &["2", "--footprint"]);
}

#[test]
fn rejects_invalid_white() {
    for (text, footprint) in [
        ("index,value,saturated\n0,1100,1\n", None),
        (
            "index,value,saturated\n0,1100,1\n",
            Some(Footprint::LightLarger),
        ),
    ] {
        assert_names(&white_error(text, footprint), &["2", "saturated"]);
    }
    let elsewhere = white("index,value\n2,1100\n", None).expect("the file is read");
    let message = error_message(read_readings("index,value\n0,500\n", &elsewhere));
    assert_names(&message, &["sample 0"]);
    let below_dark = white("index,value\n0,90\n", None).expect("the file is read");
    let message = error_message(read_readings("index,value\n0,500\n", &below_dark));
    assert_names(&message, &["2"]);
}
