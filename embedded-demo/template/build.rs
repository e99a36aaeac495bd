//! Passes linker scripts.

fn main() {
    let folder = std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
    for argument in match "{{board}}" {
        "esp32c6" => &["-Tlinkall.x", "-Tdefmt.x"][..],
        _ => &["-Tlink.x", "-Tdefmt.x", "--nmagic"],
    } {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
    println!("cargo:rustc-link-search={folder}/memory/{{board}}");
    println!("cargo:rerun-if-changed=memory");
}
