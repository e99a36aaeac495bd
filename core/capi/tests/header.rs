//! Test of the committed header: it equals the one that cbindgen generates from the sources.

#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::{env, fs};

#[test]
fn header_is_up_to_date() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(folder.join("cbindgen.toml")).unwrap();
    let mut builder = cbindgen::Builder::new().with_config(config);
    for file in [
        "status", "types", "handle", "scan", "fit", "machine", "driver",
    ] {
        builder = builder.with_src(folder.join(format!("src/{file}.rs")));
    }
    let mut header = Vec::new();
    builder.generate().unwrap().write(&mut header);
    let header = String::from_utf8(header).unwrap();

    let path = folder.join("include/glimpse.h");
    if env::var_os("GLIMPSE_BLESS").is_some() {
        fs::write(&path, &header).unwrap();
    }
    let committed = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        header == committed,
        "include/glimpse.h differs from src/: write it with `GLIMPSE_BLESS=1 cargo test --test header`"
    );
}
