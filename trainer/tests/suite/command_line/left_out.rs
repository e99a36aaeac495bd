//! Skipped entries of a directory are reported.

use std::fs;

use super::Folder;
use crate::common::assert_names;

#[test]
fn what_of_a_directory_is_left_out_is_said() {
    let folder = Folder::with("a.csv", b"theta_h,theta_d,phi_d\n1,2,3\n");
    fs::create_dir_all(folder.at("materials/more")).expect("it is made");
    folder.write("materials/GOLD_rgb.BSDF", "");
    folder.write("materials/README.md", "");
    #[cfg(target_os = "linux")]
    {
        use std::ffi::OsStr;
        use std::os::unix::ffi::OsStrExt;

        let name = OsStr::from_bytes(b"gr\xfcn.binary");
        fs::write(folder.at("materials").join(name), "").expect("it is written");
    }
    let talk = folder.fail("query materials --angles a.csv");
    // It is the more important where nothing else is there.
    assert_names(&talk, &["materials", "more", "GOLD_rgb.BSDF"]);
    #[cfg(target_os = "linux")]
    assert_names(&talk, &["gr\u{fffd}n.binary"]);
    assert!(!talk.contains("README"), "{talk}");
}
