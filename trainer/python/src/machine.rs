//! A machine with two arms.

use glimpse_core::geometry::Arms;
use glimpse_fitting::route::{LimitArgs, MachineArgs, SpeedArgs, axis_speeds};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::numbers;
use crate::error::{Result, reject};

/// A machine with two arms, for `Recipe.plan`, `Recipe.next` and `train`. Defaults are those of the recipe, if it was
/// trained for a machine.
///
/// `speed_degrees_per_second` is one number, or four for the axes theta_i, phi_i, theta_o, phi_o (or else 10). Speed 0
/// means that the machine lacks that azimuth axis. In one plane it is two numbers, of theta_i and theta_o. `settle_seconds` is the time spent at each sample (or else 0.5). The
/// limits are `max_theta_i_degrees` (or else 90), `max_theta_o_degrees` (or else 90) and `min_separation_degrees` (or
/// else 0); with `in_plane`, two arms without azimuths stay in one plane with the normal, and theta_o is negative on the
/// light's side.
#[pyclass(frozen, name = "Machine", module = "glimpse_brdf")]
pub(crate) struct PyMachine(MachineArgs);

#[pymethods]
impl PyMachine {
    #[new]
    #[pyo3(signature = (
        *, speed_degrees_per_second = None, settle_seconds = None, max_theta_i_degrees = None,
        max_theta_o_degrees = None, min_separation_degrees = None, in_plane = false,
    ))]
    fn new(
        speed_degrees_per_second: Option<&Bound<'_, PyAny>>,
        settle_seconds: Option<f64>,
        max_theta_i_degrees: Option<f32>,
        max_theta_o_degrees: Option<f32>,
        min_separation_degrees: Option<f32>,
        in_plane: bool,
    ) -> Result<Self> {
        Ok(Self(MachineArgs {
            limits: LimitArgs {
                max_theta_i: max_theta_i_degrees,
                max_theta_o: max_theta_o_degrees,
                min_separation: min_separation_degrees,
                in_plane,
            },
            speeds: SpeedArgs {
                speed: speed_degrees_per_second.map(parse_speeds).transpose()?,
                settle: settle_seconds,
            },
        }))
    }

    /// Supports copy and pickle: the arguments of the constructor.
    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<((), Bound<'py, PyDict>)> {
        let (MachineArgs { limits, speeds }, named) = (self.0, PyDict::new(py));
        named.set_item("speed_degrees_per_second", speeds.speed.map(Arms::to_array))?;
        named.set_item("settle_seconds", speeds.settle)?;
        named.set_item("max_theta_i_degrees", limits.max_theta_i)?;
        named.set_item("max_theta_o_degrees", limits.max_theta_o)?;
        named.set_item("min_separation_degrees", limits.min_separation)?;
        named.set_item("in_plane", limits.in_plane)?;
        Ok(((), named))
    }
}

impl PyMachine {
    /// Returns the options of an argument `machine`.
    pub(crate) fn args(machine: Option<&Bound<'_, Self>>) -> MachineArgs {
        machine.map_or_else(MachineArgs::default, |machine| machine.get().0)
    }
}

/// Parses degrees per second: one number for all axes, or one for each that the machine has.
fn parse_speeds(speeds: &Bound<'_, PyAny>) -> Result<Arms<f64>> {
    let speeds = numbers(speeds, "speed_degrees_per_second")?;
    let speeds: Vec<f64> = speeds.iter().copied().collect();
    match axis_speeds(&speeds) {
        Some(speeds) => Ok(speeds),
        None => reject(format!(
            "speed_degrees_per_second must be one number for all axes, or four, such as (20, 10, 20, 10), or two in one plane, \
             not {} numbers",
            speeds.len()
        )),
    }
}
