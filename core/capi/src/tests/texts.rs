//! Tests of the status texts and the version.

use core::ffi::CStr;
use std::collections::HashSet;
use std::format;
use std::vec::Vec;

use glimpse_core::error::ErrorCode;

use crate::status::{glimpse_status, glimpse_status_text, glimpse_version, texts};

fn text(status: i32) -> &'static str {
    let text = glimpse_status_text(status);
    unsafe { CStr::from_ptr(text) }.to_str().unwrap()
}

/// The header has every status with a text, and each text is different. That of an argument has its name.
#[test]
fn status_texts_are_unique() {
    let header = include_str!("../../include/glimpse.h");
    let statuses = header.lines().filter_map(|line| {
        let status = line.trim().strip_prefix("GLIMPSE_STATUS_")?;
        let (name, number) = status.trim_end_matches(',').split_once(" = ")?;
        Some((name, number.parse().ok()?))
    });
    let statuses: Vec<(&str, i32)> = statuses.collect();
    assert_eq!(statuses.len(), texts().count());
    let unknown = text(-1000);
    assert_eq!(text(i32::MAX), unknown);
    let mut found = HashSet::from([unknown]);
    for (name, number) in statuses {
        assert!(found.insert(text(number)), "{name}");
        assert_eq!(text(number).starts_with("argument"), number < 0, "{name}");
        assert_eq!(
            name.starts_with("ARGUMENT_"),
            number < 0 && !(-4..-2).contains(&number)
        );
    }
}

/// Numbers, names and texts equal those of `glimpse-core`. Functions that the library does not have use other codes.
#[test]
fn error_codes_are_statuses() {
    for code in ErrorCode::ALL {
        let status = glimpse_status::from(*code);
        if matches!(*code as u16, 28 | 109..) {
            assert_ne!(status as i32, *code as i32);
            continue;
        }
        assert_eq!(status as i32, *code as i32);
        assert_eq!(format!("{status:?}"), format!("{code:?}"));
        assert_eq!(text(status as i32), code.text());
    }
    // Some of these statuses have no error code.
    let is_exempt =
        |status: &glimpse_status| matches!(*status as i32, i32::MIN..=17 | 19 | 21 | 83);
    for (status, _) in texts().filter(|(status, _)| !is_exempt(status)) {
        assert!(
            ErrorCode::from_number(status as u16).is_some(),
            "{status:?}"
        );
    }
}

#[test]
fn version_matches_crate() {
    let version = unsafe { CStr::from_ptr(glimpse_version()) };
    assert_eq!(version.to_str().unwrap(), env!("CARGO_PKG_VERSION"));
    let line = concat!(
        "#define GLIMPSE_VERSION \"",
        env!("CARGO_PKG_VERSION"),
        "\"\n"
    );
    assert!(include_str!("../../include/glimpse.h").contains(line));
}
