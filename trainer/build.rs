//! Finds the commit that is built, for `trainer --version`; without git, or in a package that was
//! unpacked somewhere, there is none, and only the version is said.
//!
//! A build script that ran after every commit would have everything of this package compiled
//! again. So it runs once, and tells where git writes down what was checked out: the program
//! includes that file and takes the commit out of it as it is compiled, so that after a commit only
//! the program is compiled again.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rustc-check-cfg=cfg(commit)");
    let Some(log) = log_of_commits() else {
        return;
    };
    println!("cargo:rustc-cfg=commit");
    println!("cargo:rustc-env=LOG_OF_COMMITS={}", log.display());
}

/// git's log of what HEAD was, whose last line is of what it is.
fn log_of_commits() -> Option<PathBuf> {
    let package = env::var_os("CARGO_MANIFEST_DIR")?;
    let package = Path::new(&package);
    // A published package may lie within somebody else's repository.
    if package.join(".cargo_vcs_info.json").exists() {
        return None;
    }
    let git = |arguments: &[&str]| {
        let output = Command::new("git")
            .args(arguments)
            .current_dir(package)
            .output()
            .ok()?;
        let text = String::from_utf8(output.stdout).ok()?;
        output.status.success().then(|| text.trim_end().to_owned())
    };
    git(&["ls-files", "--error-unmatch", "build.rs"])?;
    if git(&["rev-parse", "--show-prefix"])? != "trainer/" {
        return None;
    }
    let log = package.join(git(&["rev-parse", "--git-path", "logs/HEAD"])?);
    let head = git(&["rev-parse", "HEAD"])?;
    let text = std::fs::read_to_string(&log).ok()?;
    let last = text.lines().last()?.split(' ').nth(1)?;
    if last != head {
        return None;
    }
    // A file that never changes: where it is gone the log is gone too, and is looked for anew.
    let constant = package.join(git(&["rev-parse", "--git-path", "description"])?);
    if constant.exists() {
        println!("cargo:rerun-if-changed={}", constant.display());
    }
    Some(log)
}
