//! Check of damaged MERL tables: the reader rejects a table, or returns a valid BRDF.

use std::fs::File;
use std::io::Write;
use std::os::fd::AsRawFd;
use std::path::PathBuf;
use std::sync::LazyLock;

use glimpse_core::geometry::HalfDifference;
use glimpse_materials::{Brdf, MerlTable, to_merl};

use crate::{Damage, check_material, check_rejection};

/// A reddish Lambertian BRDF.
struct Diffuse;

impl Brdf for Diffuse {
    fn evaluate(&self, _: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        brdf.fill([0.3, 0.2, 0.1]);
    }
}

static VALID_TABLE: LazyLock<Vec<u8>> =
    LazyLock::new(|| to_merl(&Diffuse).expect("the values are finite"));

/// Checks one input.
pub fn check(input: &[u8]) {
    let Some(damage) = Damage::from_input(input) else {
        return;
    };
    let mut bytes = VALID_TABLE.clone();
    damage.apply(&mut bytes);
    // The file has no name, and is in memory if `/dev/shm` exists.
    let file = tempfile::tempfile_in("/dev/shm").or_else(|_| tempfile::tempfile());
    let mut file: File = file.expect("a temporary file");
    file.write_all(&bytes).expect("room for a table");
    let path = format!("/proc/self/fd/{}", file.as_raw_fd());
    match MerlTable::read(&PathBuf::from(&path)) {
        Ok(table) => {
            assert_eq!(bytes.len(), VALID_TABLE.len());
            check_material(&table);
        }
        Err(error) => check_rejection(&error, &path),
    }
}
