//! What of a directory is not read is said.

use std::fs;

use super::common::assert_names;
use super::fail;

#[test]
fn what_of_a_directory_is_left_out_is_said() {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let at = |name: &str| scratch.path().join(name);
    fs::create_dir_all(at("materials/more")).expect("it is made");
    fs::write(at("materials/GOLD_rgb.BSDF"), "").expect("it is written");
    fs::write(at("materials/README.md"), "").expect("it is written");
    fs::write(at("a.csv"), "theta_h,theta_d,phi_d\n1,2,3\n").expect("it is written");
    #[cfg(target_os = "linux")]
    {
        use std::ffi::OsStr;
        use std::os::unix::ffi::OsStrExt;

        let name = OsStr::from_bytes(b"gr\xfcn.binary");
        fs::write(at("materials").join(name), "").expect("it is written");
    }
    let talk = fail(scratch.path(), &["query", "materials", "--angles", "a.csv"]);
    // It is the more important where nothing else is there.
    assert_names(&talk, &["materials", "more", "GOLD_rgb.BSDF"]);
    #[cfg(target_os = "linux")]
    assert_names(&talk, &["gr\u{fffd}n.binary"]);
    assert!(!talk.contains("README"), "{talk}");
}
