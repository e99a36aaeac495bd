//! Tests of the status texts and the version.

use core::ffi::CStr;
use std::collections::HashSet;

use glimpse_core::error::ErrorCode;

use crate::status::{OWN, glimpse_status_text, glimpse_version};

fn text(status: i32) -> &'static str {
    let text = glimpse_status_text(status);
    unsafe { CStr::from_ptr(text) }.to_str().unwrap()
}

/// Each status has a different text. An argument's text starts with its name, and an error code's is that of the code.
#[test]
fn status_texts_are_unique() {
    let unknown = text(-1000);
    assert_eq!(text(i32::MAX), unknown);
    let mut found = HashSet::from([unknown]);
    for (number, ..) in OWN {
        assert!(found.insert(text(*number)), "{number}");
        assert_eq!(text(*number).starts_with("argument"), *number < 0);
    }
    for code in ErrorCode::ALL {
        assert_eq!(text(code.number().into()), code.text());
        assert!(found.insert(code.text()), "{code:?}");
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
