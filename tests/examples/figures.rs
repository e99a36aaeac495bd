//! Prints the table of `core/docs/costs.md`: costs of fits on the board, of Neural on other microcontrollers, and of a
//! complete firmware.
//!
//! `tests/run targets` builds the binaries and prints the same figures as lines `name=value`.

use glimpse_tests::figures::{Extent, demo_figures, figures};
use glimpse_tests::microcontroller::BOARD;

fn main() {
    let mut figures = figures(Extent::All);
    figures.retain(|(name, _)| {
        let shown = name.starts_with(BOARD.triple) || name.contains(".neural");
        // These differ little from those with libm.
        shown && !name.contains("-micromath")
    });
    figures.extend(demo_figures());
    println!(
        "| target | model | instructions: parse | BRDF | fit | cycles of a fit | flash | static RAM | stack |"
    );
    println!("|---|---|---:|---:|---:|---:|---:|---:|---:|");
    for row in figures.chunk_by(|(a, _), (b, _)| row_of(a) == row_of(b)) {
        let name = row.first().map_or("", |(name, _)| row_of(name));
        let cell = |figure: &str| {
            let cell = row.iter().find(|(name, _)| name.ends_with(figure));
            cell.map(|(_, value)| group_digits(*value))
                .unwrap_or_default()
        };
        let columns = [
            ".parse_instructions",
            "brdf_instructions",
            "fit_instructions",
            "fit_cycles",
            "text_bytes",
            "static_ram_bytes",
            "stack_bytes",
        ];
        let (target, model) = name.rsplit_once('.').unwrap_or_default();
        println!("| {target} | {model} | {} |", columns.map(cell).join(" | "));
    }
}

/// Returns the row of a figure: the part of its name with target and model.
fn row_of(name: &str) -> &str {
    name.rsplit_once('.').map_or("", |(row, _)| row)
}

/// Formats a number with its digits in groups of three.
fn group_digits(value: u64) -> String {
    let digits = value.to_string();
    let groups = digits.as_bytes().rchunks(3).rev();
    let groups: Vec<_> = groups.map(String::from_utf8_lossy).collect();
    groups.join(",")
}
