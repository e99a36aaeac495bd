//! Many MERL tables: opened without checking every value.

use std::fs;

use glimpse_materials::{MAX_FULLY_CHECKED, Material, MerlTable, Source, SourceError};

use super::{node_angles, offset, tabulate};
use crate::{angles, network};

#[test]
fn released_pages_do_not_change_values() {
    let file = tabulate(&network(1));
    let checked = file.read();
    let opened = MerlTable::open(&file.path).expect("the table is opened");
    for angles in glimpse_materials::sampling::uniform_valid(1_000, 7) {
        assert_eq!(opened.brdf(angles), checked.brdf(angles));
        let [actual, expected] =
            [&opened, &checked].map(|table| table.brdf_with_derivative(angles));
        assert_eq!(actual, expected);
    }
    checked.release();
    let angles = angles([0.3, 0.4, 0.5]);
    assert_eq!(checked.brdf(angles), opened.brdf(angles));
}

/// A NaN value is an error in a small set, and counts as not measured in a large set, whose values are not checked. A
/// truncated file is an error in both.
#[test]
fn values_of_many_tables_are_not_checked() {
    let file = tabulate(&network(2));
    let valid = file.read();
    let (at, channel) = ([20, 30, 40], 1);
    file.patch(offset(at, channel), &f64::NAN.to_le_bytes());
    file.assert_rejected(&["NaN"]);
    let folder = tempfile::tempdir().expect("a temporary directory is created");
    let source = Source(folder.path().display().to_string());
    for number in 0..=MAX_FULLY_CHECKED {
        // The next file exceeds the limit.
        if number == MAX_FULLY_CHECKED {
            let error = source.load().err().expect("a value is NaN");
            assert!(matches!(error, SourceError::Damaged { .. }), "{error}");
        }
        let path = folder.path().join(format!("m{number}.binary"));
        fs::hard_link(&file.path, path).expect("the file is linked");
    }
    let materials = source.load().expect("the tables are opened");
    assert_eq!(materials.len(), MAX_FULLY_CHECKED + 1);
    assert_eq!(
        source.count().expect("the tables are counted"),
        materials.len()
    );
    let center = angles(node_angles(at));
    let (brdf, expected) = (materials[0].brdf(center), valid.brdf(center));
    assert!(brdf.iter().all(|value| value.is_finite()), "{brdf:?}");
    assert_eq!((brdf[0], brdf[2]), (expected[0], expected[2]));

    file.set_length(1_000);
    let error = source.load().err().expect("the file is truncated");
    assert!(matches!(error, SourceError::Damaged { .. }), "{error}");
}
