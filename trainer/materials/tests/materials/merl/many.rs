//! One of many MERL tables: opened, and not read from end to end.

use std::fs;

use glimpse_materials::{MAX_FULLY_CHECKED, Material, MerlTable, Source, SourceError};

use super::{node, offset, tabulate};
use crate::{angles, network};

/// One of many tables keeps little of its file in memory, and is looked up as any other.
#[test]
fn a_table_that_lets_go_of_its_pages_has_the_same_values() {
    let tabulated = tabulate(&network(1));
    let whole = tabulated.read();
    let one_of_many = MerlTable::open(&tabulated.path).expect("the table is opened");
    for angles in glimpse_materials::sampling::uniform_valid(1_000, 7) {
        let (found, expected) = (one_of_many.brdf(angles), whole.brdf(angles));
        assert_eq!(found, expected);
        let [found, expected] =
            [&one_of_many, &whole].map(|each| each.brdf_with_derivative(angles));
        assert_eq!(found, expected);
    }
    whole.release();
    let angles = angles([0.3, 0.4, 0.5]);
    assert_eq!(whole.brdf(angles), one_of_many.brdf(angles));
}

/// A value that is no number is an error in a small set; in a large one, where it is not looked for, it
/// counts as not measured. A file that was cut is an error in both.
#[test]
fn many_tables_are_opened_and_not_read_from_end_to_end() {
    let tabulated = tabulate(&network(2));
    let sound = tabulated.read();
    let (at, channel) = ([20, 30, 40], 1);
    tabulated.patch(offset(at, channel), &f64::NAN.to_le_bytes());
    tabulated.assert_refused(&["NaN"]);
    let folder = tempfile::tempdir().expect("a temporary directory");
    let source = Source(folder.path().display().to_string());
    for number in 0..=MAX_FULLY_CHECKED {
        // The last one makes them many.
        if number == MAX_FULLY_CHECKED {
            let error = source.load().err().expect("a value is no number");
            assert!(matches!(error, SourceError::Damaged { .. }), "{error}");
        }
        let path = folder.path().join(format!("m{number}.binary"));
        fs::hard_link(&tabulated.path, path).expect("it is linked");
    }
    let materials = source.load().expect("they are opened");
    assert_eq!(materials.len(), MAX_FULLY_CHECKED + 1);
    assert_eq!(source.count().expect("they are counted"), materials.len());
    let near = angles(node(at));
    let (found, expected) = (materials[0].brdf(near), sound.brdf(near));
    assert!(found.iter().all(|value| value.is_finite()), "{found:?}");
    assert_eq!((found[0], found[2]), (expected[0], expected[2]));

    tabulated.set_length(1_000);
    let error = source.load().err().expect("it is cut");
    assert!(matches!(error, SourceError::Damaged { .. }), "{error}");
}
