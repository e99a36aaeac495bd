//! Dialects of tables: each is read with the right values, or refused with the line, the column and the value.

use super::{error_message, read_brdf};
use crate::common::assert_names;

const NAMES: &str = "theta_h,theta_d,phi_d,r,g,b";
const ROWS: &str = "0,30,0,0.25,0.5,0.75\n20,10,90,1,2,3\n";
const DEGREES: &str = "deg,deg,°,1/sr,1/sr,sr^-1";

fn table() -> String {
    format!("{NAMES}\n{ROWS}")
}

/// Asserts that a text has the readings of [`ROWS`].
fn assert_same(text: &str) {
    let read = read_brdf(text).unwrap_or_else(|error| panic!("{text:?}: {error}"));
    assert_eq!(read.rows.readings.len(), 2, "{text:?}");
    for (sample, mean) in [(0, [0.25, 0.5, 0.75]), (1, [1.0, 2.0, 3.0])] {
        assert_eq!(read.samples[sample].brdf.mean(), Some(mean), "{text:?}");
    }
}

fn assert_refused(text: &str, words: &[&str]) {
    let message = error_message(read_brdf(text));
    assert_names(&message, words);
    assert!(
        !message.contains(char::is_control) && message.len() < 600,
        "{message}"
    );
}

#[test]
fn reads_line_ends_separators_and_decimal_commas() {
    let table = table();
    for same in [
        table.replace('\n', "\r\n"),
        table.replace('\n', "\r"),
        format!("\u{feff}{table}"),
        table.trim_end().to_owned(),
        table.replace(',', ";"),
        table.replace(',', "\t"),
        table.replace(',', "   "),
        table.replace(',', ";").replace('.', ","),
        table.replace(',', "\t").replace('.', ","),
        table.replace("0.25,0.5,0.75", "\"0,25\",\"0,5\",\"0,75\""),
        table
            .replace("theta_h", "\"a, b\",theta_h")
            .replace("\n0", "\n1,0")
            .replace("\n20", "\n1,20"),
        // The index of a data frame has no name.
        format!("\tx\t{}", table.replace(',', "\t"))
            .replace("\n0", "\n0\tx\t0")
            .replace("\n20", "\n1\tx\t20"),
    ] {
        assert_same(&same);
    }
}

#[test]
fn reads_lines_and_cells_around_the_table() {
    let table = table();
    for same in [
        format!("sep=,\n{table}"),
        format!("\u{feff}\"sep=;\"\r\n{}", table.replace(',', ";")),
        format!("# theta_h and theta_d in degrees\n\nInstrument: index 7\nOperator,N. N.\n{table}"),
        format!("# {table}"),
        format!("# by hand\n# {}# end\n", table.replace(',', " ")),
        format!("% {table}"),
        format!("{DEGREES}\n{table}"),
        format!("# {DEGREES}\n{table}"),
        format!("{NAMES}\n{DEGREES}\n{ROWS}"),
        format!("{NAMES}\n,,,(1/sr),,\n{ROWS}"),
        format!("Theta_h (deg),theta_d [°],phi_d,r (1/sr),g,b\n{ROWS}"),
        format!("{}\n,,,,,,,\n , \n", table.replace('\n', ",,\n")),
        format!("{NAMES}\n\n#5,5,5,9,9,9\n{ROWS}"),
        format!("{NAMES},saturated\n{}", ROWS.replace('\n', ",False\n")),
        format!(
            "{NAMES}\n{}",
            ROWS.replace("0,30,0", "0,0.523599,0")
                .replace("20,10,90", "0.349066,0.174533,1.570796")
        )
        .replacen('\n', "\nrad,rad,rad,,,\n", 1),
    ] {
        assert_same(&same);
    }
}

#[test]
fn reads_flags() {
    for (flag, expected) in [
        ("True", true),
        ("FALSE", false),
        ("1", true),
        ("0.0", false),
        ("", false),
    ] {
        let read =
            read_brdf(&format!("index,value,saturated\n0,1,{flag}\n")).expect("the file is read");
        assert_eq!(read.samples[0].brdf.saturated, expected, "{flag}");
    }
}

#[test]
fn refuses_ambiguous_and_damaged_tables() {
    let table = table();
    let semicolons = table.replace(',', ";");
    let long = "x".repeat(100_000);
    for (text, words) in [
        (table.replace("0.25", "0,25"), &["2", "7", "6"][..]),
        (table.replace(",0.75", ""), &["2", "5", "6"]),
        // A cell without a column.
        (
            table.replace("b\n", "b,,\n").replace("0.75", "0.75,9"),
            &["2", "7", "6"],
        ),
        (
            semicolons.replace("0.25;0.5;0.75", "1,234;2;3"),
            &["2", "r", "1,234"],
        ),
        (semicolons.replace("0.25", "0,25"), &["2", "r", "0,25"]),
        (
            semicolons.replace("0.25;0.5;0.75", "1.234,5;2.5;3,5"),
            &["2", "r", "1.234,5"],
        ),
        (table.replace("0.25", "1e39"), &["2", "r", "1e39"]),
        (table.replace("0.25", "-9"), &["2", "r", "-9"]),
        (table.replace("0.25", "N"), &["2", "r", "N"]),
        (table.replace("0.25", ""), &["2", "r"]),
        (table.replace("\n0,", "\n#N/A,"), &["2", "theta_h", "#N/A"]),
        (table.replace("0.75", "\"0.75"), &["2"]),
        (table.replace("0,30,0", "0,0.5236,0"), &["2"]),
        (table.replace("0.25", &long), &["2", "r"]),
        (table.replace("r,g", "\u{1b}[2J,g"), &["\\u{1b}[2j"]),
        (table.replace("g,b", "g,g"), &["1", "g"]),
        (format!("1,2,3\n{table}"), &["1", "2"]),
        (
            format!("{NAMES}\nrad,rad,rad,,,\n{ROWS}"),
            &["3", "theta_d", "30"],
        ),
        (
            format!("Theta_h (rad),theta_d (deg),phi_d,r,g,b\n{NAMES}\n{ROWS}").replacen(
                NAMES,
                "deg,deg,deg,,,",
                1,
            ),
            &["2", "theta_h", "deg"],
        ),
        (
            format!("{NAMES}\ndeg,deg,gon,,,\n{ROWS}"),
            &["2", "phi_d", "gon"],
        ),
        (
            format!("{DEGREES}\n{table}").replace("sr^-1", "%"),
            &["1", "b", "%"],
        ),
        (table.replace("r,", "r (counts),"), &["1", "r", "counts"]),
        ("PK\u{3}\u{4}\u{14}\0".to_owned(), &["CSV", "UTF-8"]),
        (table[..28].to_owned(), &["1"]),
        (ROWS.to_owned(), &["1"]),
        ("\n\n".to_owned(), &[]),
        (String::new(), &[]),
    ] {
        assert_refused(&text, words);
    }
}
