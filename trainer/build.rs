//! Passes the path of git's HEAD log to the compiler, for the commit in `trainer --version`. Outside of a git
//! checkout, as in a published package, the program prints its version without a commit.
//!
//! This script does not read the commit itself. Otherwise it would run after every commit, and cargo would
//! recompile the whole package. Instead the program includes the log and takes the commit from its last line,
//! so that a commit recompiles the program only.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rustc-check-cfg=cfg(commit)");
    let Some(log) = head_log() else {
        return;
    };
    println!("cargo:rustc-cfg=commit");
    println!("cargo:rustc-env=GIT_HEAD_LOG={}", log.display());
}

/// Returns the path of git's log of HEAD, whose last line names the current commit.
fn head_log() -> Option<PathBuf> {
    let package = env::var_os("CARGO_MANIFEST_DIR")?;
    let package = Path::new(&package);
    // A published package may be unpacked within another repository.
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
    // This file never changes. If it is removed, so is the repository, and the script runs again.
    let description = package.join(git(&["rev-parse", "--git-path", "description"])?);
    if description.exists() {
        println!("cargo:rerun-if-changed={}", description.display());
    }
    Some(log)
}
