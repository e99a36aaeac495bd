//! The documents are correct: the examples run, and the link sends the bytes in `docs/link.md`.

#![allow(clippy::duplicate_mod)] // each example is a separate program with its own scanner

#[path = "../../examples/host.rs"]
mod host;
#[path = "../../examples/recovery.rs"]
pub(crate) mod recovery;

use std::fmt::Debug;

use glimpse_core::driver::{Config, Host};
use glimpse_core::error::{Error, ErrorCode};
use glimpse_core::geometry::Directions;
use glimpse_core::gonio::{MIN_READING, Reading};
use glimpse_core::link::{FRAME_BYTES, PROTOCOL, Purpose, Reply, Request, VALUES_PER_FRAME};
use glimpse_core::model::ModelKind;
use glimpse_core::recipe::Recipe;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::link::{frame, read_frames};

/// The result is the same for every power cut.
#[test]
fn recovery_example_survives_power_cuts() {
    recovery::main().unwrap();
    let scan = |power_fails_after: &[usize]| {
        let mut memory = [0.0; recovery::MEMORY_WORDS];
        let mut flash = recovery::common::flash::Flash::new(4);
        let mut boots = power_fails_after.iter().map(|readings| {
            memory.fill(f32::NAN); // as after a power loss
            recovery::boot(recovery::RECIPES[0], &mut memory, &mut flash, *readings).unwrap()
        });
        let last = boots.next_back();
        last.flatten().unwrap()
    };
    let whole = scan(&[usize::MAX]);
    assert!((1e-5..0.06).contains(&whole.mean), "{whole:?}");
    for cut in 0..15 {
        assert_eq!(scan(&[cut, usize::MAX]), whole, "cut after {cut}");
    }
}

/// The host receives all values in order, and moves its arms once per reading, even over a noisy line.
#[test]
fn host_example_receives_fitted_values() {
    host::main().unwrap();
    for loses in [usize::MAX, 1_000, 150] {
        let mut computer = host::Computer::default();
        let (residual, values, _) = host::scan(&mut computer, loses).unwrap();
        assert_eq!(computer.values, values, "every {loses}th byte is lost");
        // Eight samples, one of them again, and two readings with the lamp off.
        assert_eq!((values.len(), computer.readings), (675, 11));
        assert!(residual.mean < 0.06, "{residual:?}");
    }
}

/// The document of the link protocol.
const LINK: &str = include_str!("../../docs/link.md");

/// The bytes of an annotated `.hex` file, without comments.
pub(crate) fn hex_bytes(text: &str) -> Vec<u8> {
    let lines = text.lines().map(|line| line.split(';').next().unwrap());
    let digits = lines.flat_map(str::split_whitespace);
    digits
        .map(|digits| u8::from_str_radix(digits, 16).unwrap())
        .collect()
}

/// Checks that the next two blocks are the content and the frame of a message.
fn check_blocks<T>(blocks: &mut impl Iterator<Item = Vec<u8>>, sequence: u32, message: T)
where
    T: Serialize + DeserializeOwned + PartialEq + Debug,
{
    let mut buffer = [0; FRAME_BYTES];
    let content = postcard::to_slice(&(sequence, &message), &mut buffer).unwrap();
    assert_eq!(blocks.next().unwrap(), content, "{message:?}");
    let bytes = blocks.next().unwrap();
    assert_eq!(bytes, frame(sequence, &message), "{message:?}");
    assert_eq!(read_frames(&bytes), [Ok((sequence, message))]);
}

#[test]
fn link_bytes_match_document() {
    let recipe = Recipe::parse(recovery::RECIPES[1]).unwrap();
    let mut blocks = include_str!("../../docs/link.hex")
        .split("\n\n")
        .map(hex_bytes);
    let hello = Request::Hello {
        protocol: PROTOCOL,
        model: recipe.model(),
        samples: recipe.samples() as u16,
        recipe: recipe.checksum(),
    };
    check_blocks(&mut blocks, 1, hello);
    check_blocks(&mut blocks, 1, Reply::Welcome { protocol: PROTOCOL });
    let directions = Directions {
        incoming: [0.6, 0.0, 0.8],
        outgoing: [-0.6, 0.0, 0.8],
    };
    let measure = Request::Measure {
        purpose: Purpose::Sample,
        index: 0,
        directions,
    };
    check_blocks(&mut blocks, 2, measure);
    let measured = Reply::Measured {
        index: 0,
        reading: Reading::new([0.25, 0.125, 0.5]),
    };
    check_blocks(&mut blocks, 2, measured);
    check_blocks(&mut blocks, 2, Reply::Skip { index: 0 });
    let failure = Error::with(ErrorCode::OutOfReach, [3, 2]);
    check_blocks(&mut blocks, 3, Request::Failed(failure));
    assert_eq!(blocks.next(), None);
}

/// The rows `| number | `Name` | ..` of the table with a title row that begins with `title`.
fn table_rows(title: &str) -> Vec<(u8, &'static str)> {
    let head = format!("| {title}");
    let table = LINK.split(&head).nth(1).unwrap();
    let rows = table.lines().skip(1).take_while(|row| row.starts_with('|'));
    rows.map(|row| {
        let mut columns = row.split('|').skip(1).map(str::trim);
        let number = columns.next().unwrap().parse().unwrap();
        (number, columns.next().unwrap().trim_matches('`'))
    })
    .collect()
}

/// Checks the numbers and names of all variants of `T` against a table.
fn check_variants<T: DeserializeOwned + Debug>(title: &str) {
    let variants = (0..).map_while(|number: u8| {
        // The variant's number, and zeros for all fields.
        let mut bytes = [0; 128];
        bytes[0] = number;
        let (variant, _) = postcard::take_from_bytes::<T>(&bytes).ok()?;
        let text = format!("{variant:?}");
        let name = text.split(|letter: char| !letter.is_alphanumeric()).next();
        Some((number, name.unwrap().to_owned()))
    });
    let written = table_rows(title).into_iter();
    let written: Vec<_> = written
        .map(|(number, name)| (number, name.to_owned()))
        .collect();
    assert_eq!(written, variants.collect::<Vec<_>>());
}

#[test]
fn message_numbers_match_document() {
    check_variants::<Request>("number | name | fields | reply |\n");
    check_variants::<Reply>("number | name | fields |\n");
    check_variants::<ModelKind>("number | model | values |\n");
}

/// Each constant appears in a line that contains the name of its field.
#[test]
fn link_constants_match_document() {
    let config = Config::new(Host::Measures);
    for (name, number) in [
        ("# ", PROTOCOL.to_string()),
        ("frame", FRAME_BYTES.to_string()),
        ("values: ", VALUES_PER_FRAME.to_string()),
        ("repeated", config.retransmit_interval_ms.to_string()),
        ("sr^-1", MIN_READING.to_string()),
    ] {
        let has_number = |line: &str| {
            let mut words = line.split(|c: char| !c.is_alphanumeric() && !".-^".contains(c));
            words.any(|word| word == number)
        };
        let mut lines = LINK.lines().filter(|line| line.contains(name));
        assert!(lines.any(has_number), "{name}: {number}");
    }
    let actual = (config.reply_timeout_ms, config.measure_timeout_ms);
    assert_eq!(actual, (2_000, 60_000));
    assert_eq!(config.attempts, 3);
}
