//! Damaged MERL tables.

use std::fs;

use glimpse_materials::Material;
use glimpse_materials::sampling::uniform_valid;

use super::tabulate;
use crate::network;

/// The number of nodes of a table.
const NODES: usize = 90 * 90 * 180;

#[test]
fn rejects_damaged_tables() {
    let file = tabulate(&network(5));
    file.read();
    let header = |dimensions: [i32; 3]| dimensions.map(i32::to_le_bytes).concat();
    let value = |number: f64| number.to_le_bytes().to_vec();
    let unmeasured = value(-1.0).repeat(NODES);
    // A single invalid value is found at every position, including values outside the range of f32. No allocation depends
    // on sizes in the header.
    for (at, bytes, words) in [
        (12, value(f64::NAN), "red phi_d 0 NaN"),
        (20, value(f64::INFINITY), "red phi_d 1 inf"),
        (28, value(f64::NEG_INFINITY), "red phi_d 2 -inf"),
        (
            12 + 8 * (NODES + 180 * (90 * 45 + 20) + 7),
            value(3.5e38),
            "green theta_h 22.500 theta_d 20 phi_d 7 3.5e38",
        ),
        (
            4 + 24 * NODES,
            value(-1e300),
            "blue theta_d 89 phi_d 179 -1e300",
        ),
        // No node was measured in a channel.
        (12, unmeasured.clone(), "100.0 % 50 %"),
        (12 + 16 * NODES, unmeasured, "100.0 % 50 %"),
    ] {
        let valid = fs::read(&file.path).expect("the file is read")[at..][..bytes.len()].to_vec();
        file.patch(at as u64, &bytes);
        file.assert_rejected(words);
        file.patch(at as u64, &valid);
    }
    file.read();
    // Longer files first, because truncation removes the values.
    let valid_length = 12 + 24 * NODES as i64;
    for change in [valid_length, 1, -1, -8, 12 - valid_length] {
        let length = (valid_length + change) as u64;
        file.set_length(length);
        file.assert_rejected(&format!("{length} {valid_length}"));
    }
    for dimensions in [[90, 90, 90], [i32::MAX; 3], [-1, 90, 180], [180, 90, 90]] {
        file.patch(0, &header(dimensions));
        let start = header(dimensions).escape_ascii().to_string();
        file.assert_rejected(&start);
    }
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
    let brdf = |table: &dyn Material| -> Vec<[f32; 3]> {
        uniform_valid(500, 3)
            .into_iter()
            .map(|angles| table.at_angles(angles))
            .collect()
    };
    let expected = brdf(&*file.read());
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
        let read = brdf(&*file.read());
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
            false => file.assert_rejected("red theta_d 2 phi_d 7"),
        }
    }
    let length = 12 + 4 * 3 * 1_458_000;
    file.patch(0, &header(180));
    file.set_length(length - 4);
    file.assert_rejected(&format!("{} {length}", length - 4));
}
