//! What the README's commands leave is not for git.

use std::path::Path;
use std::process::Command;

#[test]
fn what_commands_leave_by_default_is_ignored() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for left in [
        "quickstart/index.html",
        "paper/index.html",
        "target/release/trainer",
    ] {
        let status = Command::new("git")
            .args(["check-ignore", "--quiet", left])
            .current_dir(&root)
            .status()
            .expect("git runs");
        assert!(status.success(), "{left} would be committed");
    }
}
