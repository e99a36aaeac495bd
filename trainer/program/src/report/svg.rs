//! Shared parts of drawings: the style for light and dark mode, and number formats.

use maud::{Markup, PreEscaped, html};

/// The number of color classes: `c0` and so on. Drawings also distinguish curves and marks by shape, dash or name.
pub(super) const COLORS: usize = 7;
/// The style sheet of all drawings. The colors are those of Okabe and Ito, which remain distinct for color-blind readers.
///
/// Light and dark colors are separate rules instead of CSS variables, because some renderers lack
/// `prefers-color-scheme`. These ignore the dark rules and use the light ones.
const STYLE: &str = include_str!("drawing.css");

/// Returns an SVG of class `plot`, for a file or for embedding in a page. It has a background and is legible on any
/// page. `label` is the text for screen readers.
pub(super) fn drawing([width, height]: [f32; 2], label: &str, marks: &Markup) -> String {
    let drawing = html! {
        svg xmlns="http://www.w3.org/2000/svg" viewBox=(format!("0 0 {width} {height}"))
            class="plot" role="img" aria-label=(label) {
            style { (PreEscaped(STYLE)) }
            rect class="paper" width=(width) height=(height) {}
            (marks)
        }
    };
    drawing.into_string()
}

/// Formats a length in SVG units with one decimal.
pub(super) fn one_decimal(length: f32) -> String {
    format!("{length:.1}")
}

/// Returns the SVG path of a line through points; empty without points.
pub(super) fn path_of(points: &[[f32; 2]]) -> String {
    let points = points.iter().map(|[x, y]| format!("{x:.1} {y:.1}"));
    match points.collect::<Vec<_>>().join("L") {
        empty if empty.is_empty() => empty,
        points => format!("M{points}"),
    }
}
