//! Plans of scans: the order in which a machine's arms visit a recipe's samples.

use glimpse_fitting::choice::Choice;
use glimpse_fitting::route::Route;
use pyo3::prelude::*;

use crate::arrays::{Array, result};
use crate::error::Result;

/// Returns a route as Python's `Plan`.
pub(crate) fn plan<'py>(py: Python<'py>, route: &Route) -> Result<Bound<'py, PyAny>> {
    let visits = || route.visits.iter();
    let arguments = (
        route.order.name(),
        Array::list(visits().map(|visit| visit.index as i64)),
        Array::rows(visits().map(|visit| visit.arms.to_array())),
        Array::list(visits().map(|visit| visit.seconds)),
        route.total(),
        route.travel,
        route.to_csv(),
        route.blank_sheet(),
    );
    result(py, "Plan", arguments)
}
