//! Quantities of readings, and counts relative to a white tile.

use std::f32::consts::PI;

use glimpse_core::geometry::HalfDifference;
use glimpse_core::gonio::Footprint;
use glimpse_fitting::measurement::{
    CountCalibration, ReadingQuantity, Readings, TableArgs, TableError,
};

use super::{error_message, pattern, read_readings, rows};
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

/// Reads counts relative to the counts of a white.
fn read_counts(
    counts: &str,
    white: &str,
    footprint: Option<Footprint>,
) -> Result<Readings, TableError> {
    let quantity = ReadingQuantity::Counts(CountCalibration {
        dark: Some([100.0; 3]),
        reflectance: Some([0.5; 3]),
        saturation: Some(4_000.0),
        white: rows(white, &TableArgs::default())?,
        footprint,
    });
    read_readings(counts, quantity)
}

#[test]
fn converts_counts_with_white() {
    // At the same directions the cosines cancel: 1000 counts above dark correspond to 0.5 / pi.
    let counts = |white: f32| 100.0 + BRDF * PI / 0.5 * (white - 100.0);
    let white = "index,value\n2,2100\n0,1000\n0,1200\n";
    let text = format!(
        "index,value\n0,{}\n2,{}\n",
        counts(1_100.0),
        counts(2_100.0)
    );
    let read = read_counts(&text, white, None).expect("the file is read");
    for sample in [0, 2] {
        assert_is_brdf(read.samples[sample].brdf.mean());
    }
    let message = error_message(read_counts("index,value\n1,500\n", white, None));
    assert_names(&message, &["2", "1"]);
    let saturated = read_counts("index,value\n0,4000\n", white, None).expect("the file is read");
    assert!(saturated.samples[0].brdf.saturated);

    // With a single reading at normal incidence, one cosine remains.
    let single_row = "theta_i,phi_i,theta_o,phi_o,value\n0,0,0,0,1100\n";
    for (footprint, arm) in [(Footprint::LightLarger, 0), (Footprint::SensorLarger, 1)] {
        let cosine = cosines(2)[arm];
        let text = format!(
            "index,value\n2,{}\n",
            100.0 + cosine * (counts(1_100.0) - 100.0)
        );
        let read = read_counts(&text, single_row, Some(footprint)).expect("the file is read");
        assert_is_brdf(read.samples[2].brdf.mean());
    }
}

#[test]
fn rejects_invalid_white() {
    let light = Some(Footprint::LightLarger);
    let saturated = "index,value,saturated\n0,1100,1\n";
    let elsewhere = "theta_i,phi_i,theta_o,phi_o,value\n0,0,0,0,1100\n";
    for (white, footprint, words) in [
        (saturated, None, &["2", "saturated"][..]),
        (saturated, light, &["2", "saturated"]),
        (elsewhere, None, &["--footprint", "light", "sensor"]),
        (
            "index,value\n0,1100\n1,1100\n",
            light,
            &["2", "--footprint"],
        ),
        ("index,value\n2,1100\n", None, &["sample 0"]),
        ("index,value\n0,90\n", None, &["2"]),
    ] {
        let message = error_message(read_counts("index,value\n0,500\n", white, footprint));
        assert_names(&message, words);
    }
}
