//! An interactive web page that fits BRDFs in the browser with `glimpse-core`.
//!
//! The user moves light and camera and changes readings; the page repeats the fit. `tests/run wasm` compiles
//! `glimpse.wasm` from `trainer/viewer/wasm`. `tests/run targets` builds it again and compares the results of both
//! modules with those of core on the host.

mod data;
mod table;

use maud::{Markup, PreEscaped, html};

pub use data::{RecipeScan, Reference};

/// The WebAssembly module of core; `trainer/viewer/wasm/src/lib.rs` defines its exports.
pub const WASM: &[u8] = include_bytes!("../www/glimpse.wasm");
/// The style sheet of the page, in addition to the common one.
pub const STYLE: &str = include_str!("../www/view.css");
/// The scripts of the page, for display and input. Core computes fits, BRDFs and losses.
const SCRIPTS: [&str; 5] = [
    include_str!("../www/core.js"),
    include_str!("../www/spheres.js"),
    include_str!("../www/lobe.js"),
    include_str!("../www/readings.js"),
    include_str!("../www/view.js"),
];

/// A self-contained page: one file.
#[derive(Clone, Debug)]
pub struct View {
    /// Name of the material.
    pub title: String,
    /// Reference material, if known.
    pub reference: Option<Reference>,
    /// Recipes and their readings.
    pub scans: Vec<RecipeScan>,
}

impl View {
    /// Returns the body of the page, for a document with [`STYLE`].
    #[must_use]
    pub fn body(&self) -> Markup {
        html! {
            main.view { (PreEscaped(include_str!("../www/view.html"))) }
            script type="application/json" id="data" { (PreEscaped(self.to_json())) }
            script { @for script in SCRIPTS { (PreEscaped(script)) } }
        }
    }
}
