//! What drawings share: colors in the light and in the dark, and numbers beside their marks.

use maud::{Markup, PreEscaped, html};

/// A color on white paper, and in dark surroundings.
#[derive(Clone, Copy)]
pub(super) struct Color {
    light: &'static str,
    dark: &'static str,
}

impl Color {
    pub(super) const fn new(light: &'static str, dark: &'static str) -> Self {
        Self { light, dark }
    }
}

/// What letters and important marks are drawn in.
pub(super) const INK: Color = Color::new("#1c1c1e", "#e8e8e6");
const PAPER: Color = Color::new("#fcfcfa", "#161618");
const DIM: Color = Color::new("#5b5b62", "#a5a5a8");
const FAINT: Color = Color::new("#b4b4b8", "#55555a");

/// Colors of Okabe and Ito, which the color-blind tell apart; every color comes with a shape, a
/// dash or a name beside it.
pub(super) const COLORS: [Color; 6] = [
    Color::new("#0072b2", "#3d9bd6"),
    Color::new("#d55e00", "#ee7a2c"),
    Color::new("#009e73", "#009e73"),
    Color::new("#cc79a7", "#cc79a7"),
    Color::new("#56b4e9", "#56b4e9"),
    Color::new("#e69f00", "#e69f00"),
];

/// One rule of a drawing's style sheet: what is marked by this class has this property, `fill` or
/// `stroke`, in this color.
pub(super) type Rule = (&'static str, &'static str, Color);

/// The rules of all drawings: what is marked by classes `paper`, `dim`, `axis` and `grid`, and text.
const RULES: [Rule; 5] = [
    (".paper", "fill", PAPER),
    ("text", "fill", INK),
    (".dim", "fill", DIM),
    (".axis", "stroke", DIM),
    (".grid", "stroke", FAINT),
];
/// What is the same in any light.
const SHAPES: &str = "\
.plot text{font:13px system-ui,'DejaVu Sans',sans-serif}.plot .dim{font-size:12px}\
.plot .mid{text-anchor:middle}.plot .end{text-anchor:end}\
.plot .axis{fill:none}.plot .grid{fill:none;stroke-width:0.7}";

/// The look of a drawing: the rules of all drawings and its own, and its own shapes.
///
/// Colors are written out, twice where the dark has others: who draws without knowing of dark
/// surroundings passes those over.
fn style(rules: &[Rule], shapes: &str) -> String {
    let rules = || RULES.iter().chain(rules);
    let rule =
        |(class, property, _): &Rule, color: &str| format!(".plot {class}{{{property}:{color}}}");
    let light: String = rules().map(|each| rule(each, each.2.light)).collect();
    let dark: String = rules().map(|each| rule(each, each.2.dark)).collect();
    format!("{SHAPES}{shapes}{light}@media(prefers-color-scheme:dark){{{dark}}}")
}

/// Scalable vector graphics of class `plot`, to stand alone or within a page: a paper of their own
/// keeps them legible on any ground. `label` says what the drawing shows, to those who cannot see it.
pub(super) fn drawing(
    [width, height]: [f32; 2],
    label: &str,
    rules: &[Rule],
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

/// A length with the digits that are seen.
pub(super) fn tenths(length: f32) -> String {
    format!("{length:.1}")
}

/// A power of ten, with its exponent raised.
pub(super) fn power_of_ten(exponent: i32) -> String {
    let raise = |character| match character {
        '-' => '\u{207b}',
        '1' => '\u{b9}',
        '2' => '\u{b2}',
        '3' => '\u{b3}',
        digit => char::from_u32(0x2070 + digit.to_digit(10).unwrap_or(0)).unwrap_or(digit),
    };
    let raised: String = exponent.to_string().chars().map(raise).collect();
    format!("10{raised}")
}

/// Finds room for labels: boxes of \[left, top, right, bottom\] that are taken.
#[derive(Debug, Default)]
pub(super) struct Labels(Vec<[f32; 4]>);

/// Height of a label, and width of one of its digits.
const LABEL: [f32; 2] = [7.0, 11.0];
/// Where a label's center may be from its mark: beside, above and below, and farther off.
const AROUND: [[f32; 2]; 16] = [
    [11.0, -8.0],
    [-11.0, -8.0],
    [11.0, 8.0],
    [-11.0, 8.0],
    [13.0, 0.0],
    [-13.0, 0.0],
    [0.0, -13.0],
    [0.0, 13.0],
    [19.0, -13.0],
    [-19.0, -13.0],
    [19.0, 13.0],
    [-19.0, 13.0],
    [23.0, 0.0],
    [-23.0, 0.0],
    [0.0, -22.0],
    [0.0, 22.0],
];

impl Labels {
    /// Keeps labels off a mark.
    pub(super) fn mark(&mut self, place: [f32; 2]) {
        self.keep_off(place, [9.0, 9.0]);
    }

    /// Keeps labels off a box by its center and its size.
    pub(super) fn keep_off(&mut self, [x, y]: [f32; 2], [width, height]: [f32; 2]) {
        let (x_half, y_half) = (width / 2.0, height / 2.0);
        self.0
            .push([x - x_half, y - y_half, x + x_half, y + y_half]);
    }

    /// The middle of the base line of a label of so many digits, where it covers least.
    pub(super) fn place(&mut self, [x, y]: [f32; 2], digits: usize) -> [f32; 2] {
        let [width, height] = [LABEL[0] * digits as f32, LABEL[1]];
        let boxes = AROUND.map(|[right, down]| {
            let (x, y) = (x + right, y + down);
            [
                x - width / 2.0,
                y - height / 2.0,
                x + width / 2.0,
                y + height / 2.0,
            ]
        });
        let covered = |label: &[f32; 4]| -> f32 {
            let taken = self.0.iter();
            taken.map(|taken| overlap(label, taken)).sum()
        };
        let best = boxes
            .iter()
            .min_by(|a, b| covered(a).total_cmp(&covered(b)));
        let [left, _, right, bottom] = best.copied().unwrap_or_default();
        self.0.extend(best);
        [(left + right) / 2.0, bottom - 1.0]
    }
}

/// The area that two boxes share.
fn overlap(a: &[f32; 4], b: &[f32; 4]) -> f32 {
    let side = |low: usize| (a[low + 2].min(b[low + 2]) - a[low].max(b[low])).max(0.0);
    side(0) * side(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponents_are_raised() {
        assert_eq!(power_of_ten(-3), "10⁻³");
        assert_eq!(power_of_ten(12), "10¹²");
        assert_eq!(power_of_ten(0), "10⁰");
    }

    #[test]
    fn labels_of_marks_close_together_do_not_cover_each_other() {
        let marks = [[50.0, 50.0], [52.0, 51.0], [49.0, 53.0], [54.0, 48.0]];
        let mut labels = Labels::default();
        for mark in marks {
            labels.mark(mark);
        }
        for mark in marks {
            labels.place(mark, 1);
        }
        let placed = &labels.0[marks.len()..];
        for (index, label) in placed.iter().enumerate() {
            for other in labels.0[..marks.len()].iter().chain(&placed[..index]) {
                assert_eq!(overlap(label, other), 0.0, "{label:?} {other:?}");
            }
        }
    }
}
