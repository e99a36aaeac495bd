//! What the documents say is so: examples do what they print, and the bytes in `docs/link.md` are
//! what the link sends.

#[path = "../examples/host.rs"]
mod host;
#[path = "../examples/scan.rs"]
mod scan;
#[path = "../examples/scanner.rs"]
mod scanner;

/// Each model explains what it read, and tells that it does.
#[test]
fn the_example_of_a_scan_fits_by_all_four_models() {
    scan::main().unwrap();
    for recipe in scan::RECIPES {
        let residual = scan::scan(recipe).unwrap();
        assert!((1e-4..0.06).contains(&residual.mean), "{residual:?}");
        assert_eq!((residual.saturated, residual.clamped), (0, 0));
    }
}

/// Wherever power is cut, no reading is taken twice and the result is the same.
#[test]
fn the_example_of_a_scanner_loses_no_reading_when_power_is_cut() {
    scanner::main().unwrap();
    let mut whole = scanner::Scanner::new();
    let residual = whole.run(u32::MAX).unwrap();
    assert!(residual.is_some());
    for cut in 1..=8 {
        let mut scanner = scanner::Scanner::new();
        assert_eq!(scanner.run(cut).unwrap(), None);
        assert_eq!(scanner.run(u32::MAX).unwrap(), residual, "cut after {cut}");
        assert_eq!((scanner.readings, scanner.clock), (8, whole.clock));
    }
}

/// A host is told all values in their order, and moves its arms once for a reading, however bad the
/// line is.
#[test]
fn the_example_of_a_host_hears_what_was_fitted() {
    host::main().unwrap();
    for loses in [usize::MAX, 1_000, 150] {
        let mut computer = host::Computer::default();
        let (residual, values, _) = host::scan(&mut computer, loses).unwrap();
        assert_eq!(computer.values, values, "every {loses}th byte is lost");
        assert_eq!((values.len(), computer.readings), (675, 8));
        assert!(residual.mean < 0.06, "{residual:?}");
    }
}
