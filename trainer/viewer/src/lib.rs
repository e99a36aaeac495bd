//! A page in which light and camera move, readings change, and fits are done anew, by core itself.
//!
//! `glimpse.wasm` is `trainer/viewer/wasm` as `tests/run wasm` compiles it; `tests/run firmware` builds it once more
//! and compares what both compute with what core does on the host.

mod data;

use maud::{Markup, PreEscaped, html};

pub use data::{Reference, Shown};

/// Core for a browser, WebAssembly: what `trainer/viewer/wasm/src/lib.rs` exports.
pub const WASM: &[u8] = include_bytes!("../www/glimpse.wasm");
/// The style of the page, which follows the style of all pages.
pub const STYLE: &str = include_str!("../www/view.css");
/// What it does: numbers to pixels, fingers to directions. All else is computed by core.
const SCRIPTS: [&str; 5] = [
    include_str!("../www/core.js"),
    include_str!("../www/spheres.js"),
    include_str!("../www/lobe.js"),
    include_str!("../www/readings.js"),
    include_str!("../www/view.js"),
];

/// A page that needs nothing from elsewhere: one file.
#[derive(Clone, Debug)]
pub struct View {
    /// The material's name.
    pub title: String,
    /// The material itself, if it is known.
    pub reference: Option<Reference>,
    /// Recipes, and what was read by each.
    pub shown: Vec<Shown>,
}

impl View {
    /// The body of the page, for a document in [`STYLE`].
    #[must_use]
    pub fn body(&self) -> Markup {
        html! {
            main.view { (PreEscaped(include_str!("../www/view.html"))) }
            script type="application/json" id="data" { (PreEscaped(self.to_json())) }
            script { @for script in SCRIPTS { (PreEscaped(script)) } }
        }
    }
}
