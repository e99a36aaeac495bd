//! Integer arguments, and their ranges.

use std::ops::RangeInclusive;

use pyo3::prelude::*;
use pyo3::types::PyBool;

use crate::error::reject;

/// Defines the converter of each argument, for `from_py_with`.
macro_rules! arguments {
    ($($name:ident: $type:ty, $range:expr;)+) => {
        $(pub(crate) fn $name(value: &Bound<'_, PyAny>) -> PyResult<$type> {
            integer(value, stringify!($name), $range)
        })+
    };
}

arguments! {
    count: usize, 1..=256;
    first: usize, 1..=4096;
    levels: u32, 0..=1 << 24;
    lose: usize, 0..=4096;
    seed: u64, 0..=u64::MAX;
    seeds: u64, 1..=10_000;
    size: usize, 1..=4096;
    threads: usize, 1..=1024;
}

/// Converts an integer of Python's or NumPy's types, but neither a float nor a bool. `name` is the argument's name for the
/// error message.
pub(crate) fn integer<T: TryFrom<u64>>(
    value: &Bound<'_, PyAny>,
    name: &str,
    range: RangeInclusive<u64>,
) -> PyResult<T> {
    let number: Option<u64> = value.extract().ok();
    let valid = number.filter(|number| range.contains(number) && !value.is_instance_of::<PyBool>());
    if let Some(Ok(number)) = valid.map(T::try_from) {
        return Ok(number);
    }
    let (min, max, given) = (range.start(), range.end(), value.repr()?);
    Ok(reject(format!(
        "{name} is {given}: give an integer, {min} to {max}"
    ))?)
}
