//! A page in which light and camera move, readings change, and fits are done anew, by core itself.
//!
//! `glimpse.wasm` is `trainer/view` as `tests/run wasm` compiles it; `tests/run firmware` builds it once more
//! and compares what both compute with what core does on the host.

mod data;

use maud::{PreEscaped, html};

use super::page::document;

pub use data::{Reference, Shown};

/// Core for a browser, WebAssembly: what `trainer/view/src/lib.rs` exports.
pub const WASM: &[u8] = include_bytes!("glimpse.wasm");
/// What the page looks like, beside what all pages do.
const VIEW_STYLE: &str = include_str!("view.css");
/// What it does: numbers to pixels, fingers to directions. All else is computed by core.
const SCRIPTS: [&str; 5] = [
    include_str!("core.js"),
    include_str!("spheres.js"),
    include_str!("lobe.js"),
    include_str!("readings.js"),
    include_str!("view.js"),
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
    /// The page.
    #[must_use]
    pub fn to_html(&self) -> String {
        let body = html! {
            main.view { (PreEscaped(include_str!("view.html"))) }
            script type="application/json" id="data" { (PreEscaped(self.to_json())) }
            script { @for script in SCRIPTS { (PreEscaped(script)) } }
        };
        document(&self.title, VIEW_STYLE, &body)
    }
}
