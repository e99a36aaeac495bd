//! A MERL table, cut, extended and with other numbers here and there: it is refused, or it is a BRDF.

use std::fs::File;
use std::io::Write;
use std::os::fd::AsRawFd;
use std::path::PathBuf;
use std::sync::LazyLock;

use glimpse_core::geometry::HalfDifference;
use glimpse_materials::{Brdf, MerlTable, to_merl};

use crate::{Damage, look, refused};

/// Matt, and redder than blue.
struct Matt;

impl Brdf for Matt {
    fn evaluate(&self, _: &[HalfDifference<f32>], brdf: &mut [[f32; 3]]) {
        brdf.fill([0.3, 0.2, 0.1]);
    }
}

static VALID: LazyLock<Vec<u8>> = LazyLock::new(|| to_merl(&Matt).expect("it is finite"));

/// Checks one input.
pub fn check(input: &[u8]) {
    let Some(damage) = Damage::of(input) else {
        return;
    };
    let mut bytes = VALID.clone();
    damage.apply(&mut bytes);
    // A file without a name, in memory where there is such a place.
    let file = tempfile::tempfile_in("/dev/shm").or_else(|_| tempfile::tempfile());
    let mut file: File = file.expect("a temporary file");
    file.write_all(&bytes).expect("room for a table");
    let path = format!("/proc/self/fd/{}", file.as_raw_fd());
    match MerlTable::read(&PathBuf::from(&path)) {
        Ok(table) => {
            assert_eq!(bytes.len(), VALID.len());
            look(&table);
        }
        Err(error) => refused(&error, &path),
    }
}
