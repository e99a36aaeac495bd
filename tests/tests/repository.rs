//! Git ignores the output of the README's commands.

use std::path::Path;
use std::process::Command;

#[test]
fn default_outputs_are_ignored() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for output in [
        "quickstart/index.html",
        "paper/index.html",
        "target/release/trainer",
    ] {
        let status = Command::new("git")
            .args(["check-ignore", "--quiet", output])
            .current_dir(&root)
            .status()
            .expect("git runs");
        assert!(status.success(), "{output} is not ignored");
    }
}
