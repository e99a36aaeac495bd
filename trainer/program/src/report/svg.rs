//! Shared parts of drawings: colors for light and dark mode, and number formats.

use maud::{Markup, PreEscaped, html};

/// A color for light mode and one for dark mode.
type ThemedColor = [&'static str; 2];

const TEXT: ThemedColor = ["#1c1c1e", "#e8e8e6"];
const BACKGROUND: ThemedColor = ["#fcfcfa", "#161618"];
const SECONDARY: ThemedColor = ["#5b5b62", "#a5a5a8"];
const GRID: ThemedColor = ["#b4b4b8", "#55555a"];

/// The colors of classes `c0` and so on: those of Okabe and Ito, which remain distinct for color-blind readers, and that
/// of text. Drawings also distinguish curves and marks by shape, dash or name.
pub(super) const COLORS: [ThemedColor; 7] = [
    ["#0072b2", "#3d9bd6"],
    ["#d55e00", "#ee7a2c"],
    ["#009e73", "#009e73"],
    ["#cc79a7", "#cc79a7"],
    ["#56b4e9", "#56b4e9"],
    ["#e69f00", "#e69f00"],
    TEXT,
];

/// The rules of other classes: selector, property and color.
const RULES: [(&str, &str, ThemedColor); 5] = [
    (".paper", "fill", BACKGROUND),
    ("text", "fill", TEXT),
    (".dim", "fill", SECONDARY),
    (".axis", "stroke", SECONDARY),
    (".grid", "stroke", GRID),
];
/// The style without colors, which is the same in light and dark mode.
const COMMON_STYLE: &str = "\
.plot text{font:13px system-ui,'DejaVu Sans',sans-serif}.plot .dim{font-size:12px}\
.plot .mid{text-anchor:middle}.plot .end{text-anchor:end}\
.plot .mark{fill:currentColor}.plot .axis{fill:none}.plot .grid{fill:none;stroke-width:0.7}";

/// Returns the style sheet of a drawing: the common style, followed by its own.
///
/// Light and dark colors are separate rules instead of CSS variables, because some renderers lack
/// `prefers-color-scheme`. These ignore the dark rules and use the light ones.
fn style(shapes: &str) -> String {
    let [light, dark] = [0, 1].map(|mode| {
        let rules = RULES.iter().map(|(selector, property, color)| {
            format!(".plot {selector}{{{property}:{}}}", color[mode])
        });
        let colors = COLORS.iter().enumerate();
        let colors =
            colors.map(|(index, color)| format!(".plot .c{index}{{color:{}}}", color[mode]));
        rules.chain(colors).collect::<String>()
    });
    format!("{COMMON_STYLE}{shapes}{light}@media(prefers-color-scheme:dark){{{dark}}}")
}

/// Returns an SVG of class `plot`, for a file or for embedding in a page. It has a background and is legible on any
/// page. `label` is the text for screen readers.
pub(super) fn drawing(
    [width, height]: [f32; 2],
    label: &str,
    shapes: &str,
    marks: &Markup,
) -> String {
    let style = PreEscaped(style(shapes));
    let drawing = html! {
        svg xmlns="http://www.w3.org/2000/svg" viewBox=(format!("0 0 {width} {height}"))
            class="plot" role="img" aria-label=(label) {
            style { (style) }
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
