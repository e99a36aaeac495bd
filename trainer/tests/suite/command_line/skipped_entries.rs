//! Skipped entries of a directory are reported.

use std::fs;

use super::Folder;
use crate::common::assert_names;

#[test]
fn reports_skipped_entries() {
    let folder = Folder::with("a.csv", b"theta_h,theta_d,phi_d\n1,2,3\n");
    fs::create_dir_all(folder.at("materials/more")).expect("the folder is created");
    folder.write("materials/GOLD_rgb.BSDF", "");
    folder.write("materials/README.md", "");
    #[cfg(target_os = "linux")]
    {
        use std::ffi::OsStr;
        use std::os::unix::ffi::OsStrExt;

        let name = OsStr::from_bytes(b"gr\xfcn.binary");
        fs::write(folder.at("materials").join(name), "").expect("the file is written");
    }
    // The folder has no other entries, so the command fails.
    let messages = folder.fail("query materials --angles a.csv");
    assert_names(&messages, &["materials", "more", "GOLD_rgb.BSDF"]);
    #[cfg(target_os = "linux")]
    assert_names(&messages, &["gr\u{fffd}n.binary"]);
    assert!(!messages.contains("README"), "{messages}");
}
