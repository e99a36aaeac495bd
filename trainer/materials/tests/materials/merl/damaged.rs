//! Damaged MERL tables.

use std::fs;

use glimpse_materials::{MerlTable, SourceError};

use super::tabulate;
use crate::network;

#[test]
fn rejects_damaged_tables() {
    let file = tabulate(&network(5));
    file.read();
    // A single invalid value is found at every position, including values outside the range of f32.
    for at in [0, 1, 1_000_000, 3 * 1_458_000 - 1] {
        for (number, described) in [
            (f64::NAN, "NaN"),
            (f64::INFINITY, "inf"),
            (f64::NEG_INFINITY, "-inf"),
            (3.5e38, "3.5e38"),
            (-1e300, "-1e300"),
        ] {
            file.patch(12 + 8 * at, &number.to_le_bytes());
            file.assert_rejected(&[&at.to_string(), described]);
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
    for dimensions in [[90, 90, 360], [i32::MAX; 3], [-1, 90, 180], [180, 90, 90]] {
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
