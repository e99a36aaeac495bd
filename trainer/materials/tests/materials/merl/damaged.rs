//! MERL tables that are damaged in every way, and materials that make none.

use std::fs::{self, File};
use std::io::Write;

use glimpse_materials::{Material, MerlTable, NotFinite, SourceError, write_merl};

use super::{node, offset, tabulate};
use crate::{Made, angles, network};

#[test]
fn damaged_tables_are_refused_by_name() {
    let tabulated = tabulate(&network(5));
    let whole = 34_992_012;
    assert_eq!(
        fs::metadata(&tabulated.path).expect("it is there").len(),
        whole
    );
    tabulated.read();

    for (at, number, named) in [
        (0, f64::NAN, ["0", "NaN"]),
        (11 * 262_144, f64::INFINITY, ["2883584", "inf"]),
        (16 * 262_144, f64::NEG_INFINITY, ["4194304", "-inf"]),
    ] {
        let place = 12 + 8 * at;
        tabulated.patch(place, &number.to_le_bytes());
        tabulated.assert_refused(&named);
        tabulated.patch(place, &1.0_f64.to_le_bytes());
    }
    // A single one is found wherever it is, and so is what no f32 holds.
    for at in [0, 1, 1_000_000, 3 * 1_458_000 - 1] {
        for (number, described) in [
            (f64::NAN, "NaN"),
            (f64::NEG_INFINITY, "-inf"),
            (3.5e38, "3.5e38"),
            (-1e300, "-1e300"),
        ] {
            tabulated.patch(12 + 8 * at, &number.to_le_bytes());
            tabulated.assert_refused(&[&at.to_string(), described]);
        }
        tabulated.patch(12 + 8 * at, &0_f64.to_le_bytes());
    }
    tabulated.read();
    // A color of which nothing was measured.
    for plane in [2, 0] {
        let place = 12 + 8 * plane * 1_458_000;
        tabulated.patch(place, &(-1.0_f64).to_le_bytes().repeat(1_458_000));
        tabulated.assert_refused(&[]);
    }
    for plane in [0, 2] {
        tabulated.patch(12 + 8 * plane * 1_458_000, &[0; 8 * 1_458_000]);
    }
    tabulated.read();

    // Whatever the header says, nothing is allocated on its word.
    for dimensions in [[90, 90, 360], [i32::MAX; 3], [-1, 90, 180], [180, 90, 90]] {
        tabulated.patch(0, &dimensions.map(i32::to_le_bytes).concat());
        tabulated.assert_refused(&[&format!("{dimensions:?}"), "[90, 90, 180]"]);
    }
    tabulated.patch(0, &[90, 90, 180].map(i32::to_le_bytes).concat());
    tabulated.read();

    // Longer ones first, as a cut takes what was there.
    for length in [
        2 * whole,
        whole + 8,
        whole + 1,
        whole - 1,
        whole - 8,
        whole / 2,
        13,
        12,
    ] {
        tabulated.set_length(length);
        tabulated.assert_refused(&[&length.to_string(), &whole.to_string()]);
    }
    for length in [11, 1, 0] {
        tabulated.set_length(length);
        tabulated.assert_refused(&[&length.to_string()]);
    }

    fs::remove_file(&tabulated.path).expect("it can be removed");
    assert!(matches!(
        MerlTable::read(&tabulated.path),
        Err(SourceError::Read { .. })
    ));
}

#[test]
fn what_cannot_be_tabulated_leaves_the_old_file_alone() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let path = directory.path().join("old.binary");
    File::create(&path)
        .and_then(|mut file| file.write_all(b"old"))
        .expect("it is written");
    for number in [f32::NAN, f32::INFINITY] {
        let error = write_merl(&path, &Made(|_| [0.1, number, 0.1])).expect_err("not finite");
        let SourceError::Write {
            path: named,
            source,
        } = error
        else {
            panic!("{error}");
        };
        assert_eq!(named, path);
        let cause = source.get_ref().and_then(|cause| cause.downcast_ref());
        let cause: &NotFinite = cause.expect("it says where the BRDF is not finite");
        assert_eq!(
            (cause.value.to_bits(), cause.angles),
            (number.to_bits(), [0.0; 3])
        );
        assert_eq!(fs::read(&path).expect("it is still there"), b"old");
    }
    let nowhere = path.join("new.binary");
    let error = write_merl(&nowhere, &Made(|_| [0.1; 3])).expect_err("a file is no directory");
    assert!(matches!(error, SourceError::Write { .. }), "{error}");
    let names = fs::read_dir(directory.path()).expect("it can be listed");
    assert_eq!(names.count(), 1, "something was left behind");
}

#[test]
fn values_that_are_no_finite_floats_count_as_not_measured_if_they_come_after_opening() {
    let tabulated = tabulate(&network(6));
    let table = tabulated.read();
    let cell = [20, 30, 40];
    let (low, high) = (node(cell), node(cell.map(|k| k + 1)));
    let place = std::array::from_fn(|i| low[i] + 0.4 * (high[i] - low[i]));
    let whole = table.brdf(angles(place));
    // One corner in red, all of them in blue.
    let corners = (0..8).map(|bits| std::array::from_fn(|i| cell[i] + (bits >> i & 1)));
    let damage = |value: f64| {
        tabulated.patch(offset(cell, 0), &value.to_le_bytes());
        for corner in corners.clone() {
            tabulated.patch(offset(corner, 2), &value.to_le_bytes());
        }
        table.brdf_with_derivative(angles(place))
    };
    let not_measured = damage(-1.0);
    assert_ne!(not_measured.0[0], whole[0]);
    assert_eq!(not_measured.0[1..], [whole[1], 0.0]);
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 3.5e38, -1e300] {
        assert_eq!(damage(value), not_measured, "{value}");
    }
}
