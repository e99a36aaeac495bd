//! What of a directory is not read is said.

use std::fs;

use super::trainer;

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
    let output = trainer(scratch.path(), &["query", "materials", "--angles", "a.csv"]);
    let talk = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success());
    // It is the more important where nothing else is there.
    for part in [
        "left out of materials: ",
        "1 folder (more: not entered)",
        "1 file (GOLD_rgb.BSDF: endings must be small letters)",
        "materials holds no materials",
    ] {
        assert!(talk.contains(part), "no {part} in {talk}");
    }
    #[cfg(target_os = "linux")]
    assert!(talk.contains("n.binary: a name must be UTF-8)"), "{talk}");
    assert!(!talk.contains("README"), "{talk}");
}
