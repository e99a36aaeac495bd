//! What numbers are: quantities, and counts beside a white's.

use std::f32::consts::PI;
use std::fs;

use glimpse_core::geometry::HalfDifference;
use glimpse_core::gonio::{Footprint, Quantity};
use glimpse_trainer::measurement::{Counts, Meaning, TableError, White};

use super::{TOLERANCE, measured_as, mistake, pattern};
use crate::common::assert_names;

const BRDF: f32 = 0.25;

/// Cosines of light and sensor at a sample.
fn cosines(sample: usize) -> [f32; 2] {
    let at = HalfDifference::from_angles(pattern()[sample]);
    [at.cos_theta_i(), at.cos_theta_o()]
}

fn close(found: Option<[f32; 3]>) {
    let found = found.expect("it was read");
    assert!(
        found.iter().all(|f| (f / BRDF - 1.0).abs() < 1e-4),
        "{found:?}"
    );
}

#[test]
fn each_quantity_tells_the_same_brdf() {
    for (quantity, factor) in [
        (Quantity::Brdf, [1.0; 3]),
        (
            Quantity::BrdfTimesCosThetaI,
            [0, 1, 2].map(|i| cosines(i)[0]),
        ),
        (
            Quantity::BrdfTimesCosThetaO,
            [0, 1, 2].map(|i| cosines(i)[1]),
        ),
        (Quantity::ReflectanceFactor, [PI; 3]),
    ] {
        let rows: String = (0..3)
            .map(|i| format!("{i},{}\n", BRDF * factor[i]))
            .collect();
        let read = measured_as(&format!("index,value\n{rows}"), &Meaning::Values(quantity));
        for sample in read.expect("it is read").samples {
            close(sample.mean());
        }
    }
}

/// The message about a white that is refused.
fn refusal(text: &str, footprint: Option<Footprint>) -> String {
    match white(text, footprint) {
        Err(TableError::Damaged { what, .. }) => what,
        Err(error) => panic!("{error}"),
        Ok(_) => panic!("it is read"),
    }
}

fn white(text: &str, footprint: Option<Footprint>) -> Result<Meaning, TableError> {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let path = scratch.path().join("white.csv");
    fs::write(&path, text).expect("it is written");
    let white = White::read(&path, &pattern(), TOLERANCE, footprint);
    Ok(Meaning::Counts(Counts {
        dark: [100.0; 3],
        reflectance: [0.5; 3],
        saturation: Some(4_000.0),
        white: white?,
    }))
}

#[test]
fn counts_become_brdfs_by_a_white() {
    // At the same directions cosines cancel: 1000 counts above dark are 0.5 / pi.
    let counts = |white: f32| 100.0 + BRDF * PI / 0.5 * (white - 100.0);
    let each = white("index,value\n2,2100\n0,1000\n0,1200\n", None).expect("it is read");
    let text = format!(
        "index,value\n0,{}\n2,{}\n",
        counts(1_100.0),
        counts(2_100.0)
    );
    let read = measured_as(&text, &each).expect("it is read");
    for sample in [0, 2] {
        close(read.samples[sample].mean());
    }
    let told = mistake(measured_as("index,value\n1,500\n", &each));
    assert_names(&told, &["2", "1"]);
    let full = measured_as("index,value\n0,4000\n", &each).expect("it is read");
    assert!(full.samples[0].saturated());

    // Read once, facing both arms; then a cosine remains.
    let once = "theta_i,phi_i,theta_o,phi_o,value\n0,0,0,0,1100\n";
    for (footprint, arm) in [(Footprint::LightLarger, 0), (Footprint::SensorLarger, 1)] {
        let meaning = white(once, Some(footprint)).expect("it is read");
        let cosine = cosines(2)[arm];
        let text = format!(
            "index,value\n2,{}\n",
            100.0 + cosine * (counts(1_100.0) - 100.0)
        );
        close(measured_as(&text, &meaning).expect("it is read").samples[2].mean());
    }
    assert_names(&refusal(once, None), &["--footprint", "light", "sensor"]);
    let two = "index,value\n0,1100\n1,1100\n";
    let told = refusal(two, Some(Footprint::LightLarger));
    assert_names(&told, &["2", "--footprint"]);
}

/// Under light that comes from elsewhere counts of the white are others.
#[test]
fn a_white_is_read_the_way_round_that_the_sample_is() {
    // Sample 2, in degrees, with light and sensor exchanged.
    let [theta_i, theta_o] = cosines(2).map(|cosine| cosine.acos().to_degrees());
    let pair = HalfDifference::from_angles(pattern()[2]).directions();
    let phi = |[x, y, _]: [f32; 3]| y.atan2(x).to_degrees();
    let exchanged = format!(
        "2,{theta_o},{},{theta_i},{}",
        phi(pair.outgoing),
        phi(pair.incoming)
    );
    let head = "index,theta_i,phi_i,theta_o,phi_o,value\n";
    let row = |counts: f32| format!("{head}{exchanged},{counts}\n");
    let counts = 100.0 + BRDF * PI / 0.5 * 1_000.0;
    let turned = white(&row(1_100.0), None).expect("it is read");
    let read = measured_as(&row(counts), &turned).expect("it is read");
    close(read.samples[2].mean());
    let straight = white("index,value\n2,1100\n", None).expect("it is read");
    let told = mistake(measured_as(&row(counts), &straight));
    assert_names(&told, &["2"]);
}

#[test]
fn a_white_that_is_none_is_named() {
    for (text, footprint) in [
        ("index,value,saturated\n0,1100,1\n", None),
        (
            "index,value,saturated\n0,1100,1\n",
            Some(Footprint::LightLarger),
        ),
    ] {
        assert_names(&refusal(text, footprint), &["2", "saturated"]);
    }
    let dark = white("index,value\n0,90\n", None).expect("it is read");
    let told = mistake(measured_as("index,value\n0,500\n", &dark));
    assert_names(&told, &["2"]);
}
