//! Damaged MERL tables, and materials that cannot be tabulated.

use std::fs::{self, File};
use std::io::Write;

use glimpse_materials::{Material, MerlTable, NotFinite, SourceError, write_merl};

use super::{node_angles, offset, tabulate};
use crate::{FunctionMaterial, angles, network};

#[test]
fn rejects_damaged_tables() {
    let file = tabulate(&network(5));
    let valid_length = 34_992_012;
    assert_eq!(
        fs::metadata(&file.path).expect("the file exists").len(),
        valid_length
    );
    file.read();

    // One value in each channel.
    for (at, number, words) in [
        (0, f64::NAN, ["0", "NaN"]),
        (11 * 262_144, f64::INFINITY, ["2883584", "inf"]),
        (16 * 262_144, f64::NEG_INFINITY, ["4194304", "-inf"]),
    ] {
        let position = 12 + 8 * at;
        file.patch(position, &number.to_le_bytes());
        file.assert_rejected(&words);
        file.patch(position, &1.0_f64.to_le_bytes());
    }
    // A single invalid value is found at every position, including values outside the range of f32.
    for at in [0, 1, 1_000_000, 3 * 1_458_000 - 1] {
        for (number, described) in [
            (f64::NAN, "NaN"),
            (f64::NEG_INFINITY, "-inf"),
            (3.5e38, "3.5e38"),
            (-1e300, "-1e300"),
        ] {
            file.patch(12 + 8 * at, &number.to_le_bytes());
            file.assert_rejected(&[&at.to_string(), described]);
        }
        file.patch(12 + 8 * at, &0_f64.to_le_bytes());
    }
    file.read();
    // In a channel without measured values, all values are negative.
    for channel in [2, 0] {
        let position = 12 + 8 * channel * 1_458_000;
        file.patch(position, &(-1.0_f64).to_le_bytes().repeat(1_458_000));
        file.assert_rejected(&[]);
    }
    for channel in [0, 2] {
        file.patch(12 + 8 * channel * 1_458_000, &[0; 8 * 1_458_000]);
    }
    file.read();

    // No allocation depends on sizes in the header.
    for dimensions in [[90, 90, 360], [i32::MAX; 3], [-1, 90, 180], [180, 90, 90]] {
        file.patch(0, &dimensions.map(i32::to_le_bytes).concat());
        file.assert_rejected(&[&format!("{dimensions:?}"), "[90, 90, 180]"]);
    }
    file.patch(0, &[90, 90, 180].map(i32::to_le_bytes).concat());
    file.read();

    // Longer files first, because truncation removes the values.
    for length in [
        2 * valid_length,
        valid_length + 8,
        valid_length + 1,
        valid_length - 1,
        valid_length - 8,
        valid_length / 2,
        13,
        12,
    ] {
        file.set_length(length);
        file.assert_rejected(&[&length.to_string(), &valid_length.to_string()]);
    }
    for length in [11, 1, 0] {
        file.set_length(length);
        file.assert_rejected(&[&length.to_string()]);
    }

    fs::remove_file(&file.path).expect("the file is removed");
    assert!(matches!(
        MerlTable::read(&file.path),
        Err(SourceError::Read { .. })
    ));
}

#[test]
fn failed_write_keeps_the_old_file() {
    let directory = tempfile::tempdir().expect("a temporary directory is created");
    let path = directory.path().join("old.binary");
    File::create(&path)
        .and_then(|mut file| file.write_all(b"old"))
        .expect("the file is written");
    for number in [f32::NAN, f32::INFINITY] {
        let error = write_merl(&path, &FunctionMaterial(|_| [0.1, number, 0.1]))
            .expect_err("the BRDF is not finite");
        let SourceError::Write {
            path: error_path,
            source,
        } = error
        else {
            panic!("{error}");
        };
        assert_eq!(error_path, path);
        let cause = source.get_ref().and_then(|cause| cause.downcast_ref());
        let cause: &NotFinite = cause.expect("the cause is NotFinite");
        assert_eq!(
            (cause.value.to_bits(), cause.angles),
            (number.to_bits(), [0.0; 3])
        );
        assert_eq!(fs::read(&path).expect("the file exists"), b"old");
    }
    let below_file = path.join("new.binary");
    let error = write_merl(&below_file, &FunctionMaterial(|_| [0.1; 3]))
        .expect_err("a file is not a directory");
    assert!(matches!(error, SourceError::Write { .. }), "{error}");
    let names = fs::read_dir(directory.path()).expect("the directory is listed");
    assert_eq!(names.count(), 1, "a temporary file remains");
}

#[test]
fn values_that_become_non_finite_after_opening_count_as_not_measured() {
    let file = tabulate(&network(6));
    let table = file.read();
    let cell = [20, 30, 40];
    let (low, high) = (node_angles(cell), node_angles(cell.map(|k| k + 1)));
    let at = angles(std::array::from_fn(|i| low[i] + 0.4 * (high[i] - low[i])));
    let valid = table.brdf(at);
    // Damages one corner in red, and all corners in blue.
    let corners = (0..8).map(|bits| std::array::from_fn(|i| cell[i] + (bits >> i & 1)));
    let damage = |value: f64| {
        file.patch(offset(cell, 0), &value.to_le_bytes());
        for corner in corners.clone() {
            file.patch(offset(corner, 2), &value.to_le_bytes());
        }
        table.brdf_with_derivative(at)
    };
    let not_measured = damage(-1.0);
    assert_ne!(not_measured.0[0], valid[0]);
    assert_eq!(not_measured.0[1..], [valid[1], 0.0]);
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 3.5e38, -1e300] {
        assert_eq!(damage(value), not_measured, "{value}");
    }
}
