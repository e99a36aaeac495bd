//! Shared parts of drawings: colors for light and dark mode, and number formats.

use maud::{Markup, PreEscaped, html};

/// A color for light mode and one for dark mode.
#[derive(Clone, Copy)]
pub(super) struct ThemedColor {
    light: &'static str,
    dark: &'static str,
}

impl ThemedColor {
    pub(super) const fn new(light: &'static str, dark: &'static str) -> Self {
        Self { light, dark }
    }
}

/// The color of text and important marks.
pub(super) const TEXT: ThemedColor = ThemedColor::new("#1c1c1e", "#e8e8e6");
const BACKGROUND: ThemedColor = ThemedColor::new("#fcfcfa", "#161618");
const SECONDARY: ThemedColor = ThemedColor::new("#5b5b62", "#a5a5a8");
const GRID: ThemedColor = ThemedColor::new("#b4b4b8", "#55555a");

/// Colors of Okabe and Ito, which remain distinct for color-blind readers. Drawings also distinguish curves and
/// marks by shape, dash or name.
pub(super) const COLORS: [ThemedColor; 6] = [
    ThemedColor::new("#0072b2", "#3d9bd6"),
    ThemedColor::new("#d55e00", "#ee7a2c"),
    ThemedColor::new("#009e73", "#009e73"),
    ThemedColor::new("#cc79a7", "#cc79a7"),
    ThemedColor::new("#56b4e9", "#56b4e9"),
    ThemedColor::new("#e69f00", "#e69f00"),
];

/// A rule of a drawing's style sheet: selector, property (`fill`, `stroke` or `color`) and color.
pub(super) type StyleRule = (&'static str, &'static str, ThemedColor);

/// The rules of all drawings, for classes `paper`, `dim`, `axis` and `grid`, for text, and for series.
const COMMON_RULES: [StyleRule; 12] = [
    (".paper", "fill", BACKGROUND),
    ("text", "fill", TEXT),
    (".dim", "fill", SECONDARY),
    (".axis", "stroke", SECONDARY),
    (".grid", "stroke", GRID),
    (".c0", "color", COLORS[0]),
    (".c1", "color", COLORS[1]),
    (".c2", "color", COLORS[2]),
    (".c3", "color", COLORS[3]),
    (".c4", "color", COLORS[4]),
    (".c5", "color", COLORS[5]),
    (".c6", "color", TEXT),
];
/// The style without colors, which is the same in light and dark mode.
const COMMON_STYLE: &str = "\
.plot text{font:13px system-ui,'DejaVu Sans',sans-serif}.plot .dim{font-size:12px}\
.plot .mid{text-anchor:middle}.plot .end{text-anchor:end}\
.plot .axis{fill:none}.plot .grid{fill:none;stroke-width:0.7}";

/// Returns the style sheet of a drawing: the common rules and style, followed by its own.
///
/// Light and dark colors are separate rules instead of CSS variables, because some renderers lack
/// `prefers-color-scheme`. These ignore the dark rules and use the light ones.
fn style(rules: &[StyleRule], shapes: &str) -> String {
    let all_rules = || COMMON_RULES.iter().chain(rules);
    let css_rule = |(selector, property, _): &StyleRule, color: &str| {
        format!(".plot {selector}{{{property}:{color}}}")
    };
    let light: String = all_rules()
        .map(|rule| css_rule(rule, rule.2.light))
        .collect();
    let dark: String = all_rules()
        .map(|rule| css_rule(rule, rule.2.dark))
        .collect();
    format!("{COMMON_STYLE}{shapes}{light}@media(prefers-color-scheme:dark){{{dark}}}")
}

/// Returns an SVG of class `plot`, for a file or for embedding in a page. It has a background and is legible on any
/// page. `label` is the text for screen readers.
pub(super) fn drawing(
    [width, height]: [f32; 2],
    label: &str,
    rules: &[StyleRule],
    shapes: &str,
    marks: &Markup,
) -> String {
    let style = PreEscaped(style(rules, shapes));
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
