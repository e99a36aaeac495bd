//! Test of the committed header: it equals the one that cbindgen generates from the sources.

use std::path::Path;
use std::string::String;
use std::vec::Vec;
use std::{env, format, fs};

use glimpse_core::error::ErrorCode;

use crate::status::OWN;

/// Returns the source of the statuses with an enum. Cbindgen expands no macros.
fn statuses() -> String {
    let variant = |number: i32, name: &str, text: &str| format!("/// {text}\n{name} = {number},\n");
    let own = OWN.iter();
    let own = own.map(|(number, name, text)| variant(*number, name, text.to_str().unwrap()));
    let codes = ErrorCode::ALL.iter();
    let codes = codes.map(|c| variant(c.number().into(), &format!("{c:?}"), c.text()));
    let variants = own.chain(codes).collect::<String>();
    let variants = format!("enum glimpse_status {{\n{variants}}}");
    let source = include_str!("../status.rs").replace("#[repr(transparent)]", "#[repr(i32)]");
    source.replace("struct glimpse_status(i32);", &variants)
}

#[test]
fn header_is_up_to_date() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(folder.join("cbindgen.toml")).unwrap();
    let temporary = tempfile::tempdir().unwrap();
    let status = temporary.path().join("status.rs");
    fs::write(&status, statuses()).unwrap();
    let mut builder = cbindgen::Builder::new()
        .with_config(config)
        .with_src(status);
    for file in [
        "types", "handle", "scan", "store", "fit", "machine", "driver",
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
        "include/glimpse.h differs from src/: write it with `GLIMPSE_BLESS=1 cargo test header`"
    );
}
