//! Rows in any order, missing and repeated rows, rows with angles or index, and errors of invalid rows.

use glimpse_core::geometry::{Directions, HalfDifference};
use glimpse_fitting::measurement::{
    AngleArgs, AngleUnit, ReadingStatus, SampleReading, TableArgs, angles_from_vectors,
};

use super::{error_message, read_brdf, rows};
use crate::common::assert_names;

#[test]
fn accepts_any_order_missing_and_repeated_rows() {
    // Two readings of sample 0 at theta_i = theta_o = 30 degrees, rotated about the normal and with small errors.
    // Rows without values do not count.
    let read = read_brdf(
        "b,note,theta_o,phi_o,theta_i,phi_i,g,r\n\
         0.3,x,30.1,10,30,190.2,0.2,0.1\n\
         ,,30,10,30,190,,\n\
         0.5,\"a, b\",29.9,10,30,190,0.4,0.3\n\
         nan,,30,10,30,190,NaN,nan\n",
    )
    .expect("the file is read");
    assert_eq!(read.rows.readings.len(), 2);
    let is_missing = |sample: &SampleReading| sample.status == ReadingStatus::Missing;
    assert_eq!(read.indices(is_missing), [1, 2]);
    let mean = read.samples[0].brdf.mean().expect("a reading");
    for (mean, expected) in mean.into_iter().zip([0.2, 0.3, 0.4]) {
        assert!((mean - expected).abs() < 1e-6);
    }
    // The standard deviation is 0.1414 in each channel, and the sum of the means is 0.9.
    let varies = read.samples[0]
        .coefficient_of_variation()
        .expect("two readings");
    assert!((varies - 3.0 * 0.141_421 / 0.9).abs() < 1e-4, "{varies}");
    assert_eq!(read.samples[1].coefficient_of_variation(), None);
    let far = read.max_distance.expect("rows with directions");
    assert!((far.degrees - 0.1).abs() < 1e-3, "{far:?}");
}

#[test]
fn accepts_single_channel_and_index() {
    // Spreadsheets may write capitals, and indices with a decimal point.
    let text = "Index,Value,saturated\n2.0,0.5,1\n0,0.25,0\n";
    let read = read_brdf(text).expect("the file is read");
    assert_eq!(read.samples[2].brdf.mean(), Some([0.5; 3]));
    assert!(read.samples[2].brdf.saturated && !read.samples[0].brdf.saturated);
    let is_missing = |sample: &SampleReading| sample.status == ReadingStatus::Missing;
    assert_eq!(read.indices(is_missing), [1]);
    assert_eq!(read.max_distance, None);
    // With an index, angles are optional; if present, they are checked.
    let text = "theta_h,index,theta_d,phi_d,value\n,1,,,0.5\n20,1,10,90.2,0.7\n";
    let read = read_brdf(text).expect("the file is read");
    assert_eq!(read.samples[1].brdf.count, 2);
}

#[test]
fn errors_name_line_and_column() {
    for (text, words) in [
        ("r,g,b\n1,2,3\n", &["theta_h", "theta_i", "index"][..]),
        ("index,r,g\n", &["r, g, b", "value"]),
        ("index,r,g,b,value\n", &["r, g, b", "value"]),
        ("index,value\n", &[]),
        ("index,value\n0,1,5\n", &["2", "3"]),
        ("index,value\n0,\n1,nan\n", &[]),
        ("index,value\n0,1\n\n3,1\n", &["4", "index", "3", "2"]),
        ("index,value\n-1,1\n", &["2", "index", "-1"]),
        ("index,value\n,1\n", &["2", "index"]),
        ("index,r,g,b\n0,1,inf,1\n", &["2", "g", "inf"]),
        (
            "index,value,saturated\n0,1,maybe\n",
            &["2", "saturated", "maybe"],
        ),
        ("index,value\n0,-1.5\n", &["2", "value", "-1.5", "-1"]),
        (
            "theta_h,theta_d,phi_d,value\n0,x,0,1\n",
            &["2", "theta_d", "x"],
        ),
        ("theta_h,theta_d,phi_d,value\n0,30,nan,1\n", &["2", "phi_d"]),
    ] {
        assert_names(&error_message(read_brdf(text)), words);
    }
}

#[test]
fn error_names_nearest_sample() {
    let message = error_message(read_brdf(
        "theta_i,phi_i,theta_o,phi_o,value\n30,0,30,180,1\n30,0,31.2,180,1\n",
    ));
    let near = ["3", "1.20", "theta_o", "0", "30", "180", "0.5"];
    assert_names(&message, &near);
    let message = error_message(read_brdf("theta_h,theta_d,phi_d,index,value\n0,30,0,1,1\n"));
    assert_names(&message, &["2", "1", "0"]);
}

#[test]
fn remedy_does_not_depend_on_the_name_of_a_column() {
    let args = TableArgs {
        angles: AngleArgs {
            unit: Some(AngleUnit::Radians),
            ..AngleArgs::default()
        },
        ..TableArgs::default()
    };
    let text = "theta_h,theta_d,phi_d,value\n0,x,0,1\n";
    let message = error_message(rows(text, &args));
    assert!(!message.contains("degrees"), "{message}");
}

/// Rounding turns the half vector of mirrored directions, and not their angles on the device.
#[test]
fn mirrored_directions_have_the_angles_of_the_device() {
    for azimuth in [0.0_f64, 0.3, 1.0, 2.5, 4.0] {
        let pair = [0.0, std::f64::consts::PI].map(|turn| {
            let (sin, cos) = (azimuth + turn).sin_cos();
            [0.5 * cos, 0.5 * sin, 0.75_f64.sqrt()]
        });
        let device = HalfDifference::from_directions(&Directions {
            incoming: pair[0].map(|x| x as f32),
            outgoing: pair[1].map(|x| x as f32),
        });
        let host = HalfDifference::from_angles(angles_from_vectors(pair[0], pair[1]).unwrap());
        let device = device.unwrap();
        assert!(
            (host.dx - device.dx).abs() + host.dy.abs() < 1e-6,
            "{host:?}"
        );
    }
}
