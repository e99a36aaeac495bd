//! Tests of glimpse-scanner on a host, in virtual time.

mod faults;
mod motion;
mod panel;
#[allow(dead_code)] // core's tests use all of it
#[path = "../../../../core/tests/suite/random.rs"]
mod random;
mod scans;

static N8: &[u8] = include_bytes!("../../../../trainer/recipes/completed/neural-n8.recipe");
static N16: &[u8] = include_bytes!("../../../../trainer/recipes/completed/neural-n16.recipe");
