//! Damaged MERL tables.

use std::fs;

use glimpse_materials::sampling::uniform_valid;
use glimpse_materials::{Brdf, MerlTable, SourceError};

use super::tabulate;
use crate::network;

#[test]
fn rejects_damaged_tables() {
    let file = tabulate(&network(5));
    file.read();
    // A single invalid value is found at every position, including values outside the range of f32.
    for (at, place) in [
        (0, ["red", "phi_d 0"]),
        (1, ["red", "phi_d 1"]),
        (
            1_458_000 + 180 * (90 * 45 + 20) + 7,
            ["green", "theta_h 22.500, theta_d 20 and phi_d 7"],
        ),
        (3 * 1_458_000 - 1, ["blue", "theta_d 89 and phi_d 179"]),
    ] {
        for (number, described) in [
            (f64::NAN, "NaN"),
            (f64::INFINITY, "inf"),
            (f64::NEG_INFINITY, "-inf"),
            (3.5e38, "3.5e38"),
            (-1e300, "-1e300"),
        ] {
            file.patch(12 + 8 * at, &number.to_le_bytes());
            file.assert_rejected(&[place[0], place[1], described]);
        }
        file.patch(12 + 8 * at, &0_f64.to_le_bytes());
    }
    // No node was measured in a channel.
    for channel in [2, 0] {
        let position = 12 + 8 * channel * 1_458_000;
        file.patch(position, &(-1.0_f64).to_le_bytes().repeat(1_458_000));
        file.assert_rejected(&["100.0 %", "50 %"]);
        file.patch(position, &[0; 8 * 1_458_000]);
    }
    // No allocation depends on sizes in the header.
    for dimensions in [[90, 90, 90], [i32::MAX; 3], [-1, 90, 180], [180, 90, 90]] {
        file.patch(0, &dimensions.map(i32::to_le_bytes).concat());
        file.assert_rejected(&[&format!("{dimensions:?}"), "[90, 90, 180]"]);
    }
    file.patch(0, &[90, 90, 180].map(i32::to_le_bytes).concat());
    file.read();

    // Longer files first, because truncation removes the values.
    let valid_length = 34_992_012;
    for change in [valid_length, 1, -1, -8, 12 - valid_length] {
        let length = (valid_length + change) as u64;
        file.set_length(length);
        file.assert_rejected(&[&length.to_string(), &valid_length.to_string()]);
    }
    for length in [11, 0] {
        file.set_length(length);
        file.assert_rejected(&["short"]);
    }

    fs::remove_file(&file.path).expect("the file is removed");
    assert!(matches!(
        MerlTable::read(&file.path),
        Err(SourceError::Read { .. })
    ));
}

fn encoded<const N: usize>(values: &[f64], bytes: fn(f64) -> [u8; N]) -> Vec<u8> {
    values.iter().copied().flat_map(bytes).collect()
}

/// Writes the values of a file in another form: single precision, or both halves of phi_d.
#[test]
fn other_forms_are_read_like_the_standard_one() {
    let network = network(5);
    let file = tabulate(&network);
    let bytes = fs::read(&file.path).expect("the file is read");
    let values: Vec<f64> = bytes[12..]
        .as_chunks()
        .0
        .iter()
        .map(|bytes| f64::from_le_bytes(*bytes))
        .collect();
    // The table is mapped, so that it is read before the file changes.
    let brdf = |table: &MerlTable| -> Vec<[f32; 3]> {
        uniform_valid(500, 3)
            .into_iter()
            .map(|angles| table.at_angles(angles))
            .collect()
    };
    let expected = brdf(&file.read());
    let halves: Vec<f64> = values
        .chunks(180)
        .flat_map(|half| [half, half].concat())
        .collect();
    let single = |values: &[f64]| encoded(values, |value| (value as f32).to_le_bytes());
    let double = |values: &[f64]| encoded(values, f64::to_le_bytes);
    let header = |phi: i32| [90, 90, phi].map(i32::to_le_bytes).concat();
    for (phi, values) in [
        (180, single(&values)),
        (360, double(&halves)),
        (360, single(&halves)),
    ] {
        fs::write(&file.path, [header(phi), values].concat()).expect("the file is written");
        let read = brdf(&file.read());
        for (read, expected) in read.as_flattened().iter().zip(expected.as_flattened()) {
            assert!(
                (read - expected).abs() <= 1e-6 * expected.abs(),
                "{phi}: {read} {expected}"
            );
        }
    }
    // Red at theta_h = 0, theta_d = 2 degrees, phi_d = 187 degrees.
    for (factor, is_read) in [(1.0005, true), (1.002, false)] {
        let mut halves = halves.clone();
        halves[2 * 360 + 187] *= factor;
        fs::write(&file.path, [header(360), double(&halves)].concat())
            .expect("the file is written");
        match is_read {
            true => drop(file.read()),
            false => file.assert_rejected(&["red", "theta_d 2 and phi_d 7"]),
        }
    }
    let length = 12 + 4 * 3 * 1_458_000;
    file.patch(0, &header(180));
    file.set_length(length - 4);
    file.assert_rejected(&[&(length - 4).to_string(), &length.to_string()]);
}
