//! Memory: no less than it takes, and little more.

use crate::configuration::{ALIGNMENT, COMPONENTS, SAMPLES, driver_bytes, scan_bytes};
use crate::driver::glimpse_driver_bytes;
use crate::scan::glimpse_scan_bytes;

/// The compiler checks that it is enough; this test, that little is wasted.
#[test]
fn the_constants_of_the_header_waste_little() {
    let scan = scan_bytes(SAMPLES, COMPONENTS);
    let driver = driver_bytes(SAMPLES, COMPONENTS);
    let (least_scan, least_driver) = (glimpse_scan_bytes(), glimpse_driver_bytes());
    std::println!("scan {least_scan} of {scan}, driver {least_driver} of {driver}");
    assert!((least_scan..least_scan + 512).contains(&scan));
    assert!((least_driver..least_driver + 1024).contains(&driver));
    assert_eq!(ALIGNMENT, 8);
}
