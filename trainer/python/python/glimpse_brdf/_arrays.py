"""Conversion of arguments to arrays of numbers, and to JSON."""

import json
from typing import Any, Optional, Sequence

import numpy as np
import numpy.typing as npt

from . import GlimpseError


def numbers(argument: npt.ArrayLike, name: str) -> npt.NDArray[np.float64]:
    """Converts an array of any real type and layout. `name` is the argument's name for error messages."""
    try:
        array = np.asarray(argument)
    except Exception as error:
        raise GlimpseError(f"{name} must be an array of numbers: {error}") from error
    if array.dtype.kind not in "fiub":
        raise GlimpseError(f"{name} must be an array of numbers: its dtype is {array.dtype}; convert it to floats")
    return array.astype(np.float64)


def rows(
    argument: npt.ArrayLike, name: str, count: Optional[int], columns: int, hint: str
) -> npt.NDArray[np.float64]:
    """Converts an array of `count` rows, or of any number of rows. `hint` follows the shape in the error message."""
    array = numbers(argument, name)
    if array.ndim != 2 or array.shape[1] != columns or count not in (None, len(array)):
        expected = f"({'n' if count is None else count}, {columns})"
        raise GlimpseError(f"{name} must have the shape {expected}{hint}, not {array.shape}")
    return array


def channels(argument: npt.ArrayLike, name: str) -> npt.NDArray[np.float64]:
    """Converts one number for all channels, or one for each, to an array of shape (3,)."""
    array = numbers(argument, name).ravel()
    if array.size not in (1, 3):
        raise GlimpseError(f"{name} must be one number, or three, not {array.size}")
    return np.resize(array, 3)


# The reasons for which arguments of `fit` have no effect.
_UNUSED = {
    "the file states it": ["saturated", "noise", "wavelengths", "instrument"],
    "the readings are counts with white": ["quantity"],
    "change the arrays instead": ["ignore", "convention", "unit", "azimuth_unit"],
    "it requires white, the counts of a white reference": [
        "white_directions",
        "footprint",
        "dark",
        "white_reflectance",
        "saturation",
    ],
}


def refuse_unused(arguments: dict[str, Any]) -> None:
    """Refuses keyword arguments of `fit` that nothing has taken."""
    for name, value in arguments.items():
        reason = next((reason for reason, names in _UNUSED.items() if name in names), None)
        if reason is None:
            raise TypeError(f"fit() got an unexpected keyword argument '{name}'")
        if value is not None:
            raise GlimpseError(f"{name} has no effect: {reason}")


def pairs(
    incoming: npt.ArrayLike, outgoing: Optional[npt.ArrayLike], free: Sequence[bool]
) -> npt.NDArray[np.float64]:
    """Returns pairs of unit vectors, of shape (..., 2, 3), from an array of that shape, or from two arrays of shape
    (..., 3) that are broadcast. Those for which `free` is True may be NaN.
    """
    if outgoing is None:
        array = numbers(incoming, "directions")
        if array.shape[-2:] != (2, 3):
            raise GlimpseError(
                "directions must have the shape (..., 2, 3), incoming and outgoing unit vectors, not "
                f"{array.shape}; or pass both as two arrays (..., 3)"
            )
    else:
        both = [numbers(incoming, "incoming"), numbers(outgoing, "outgoing")]
        for array, name in zip(both, ["incoming", "outgoing"]):
            if array.shape[-1:] != (3,):
                raise GlimpseError(f"{name} must have the shape (..., 3), not {array.shape}")
        try:
            array = np.stack(np.broadcast_arrays(*both), -2)
        except ValueError as error:
            raise GlimpseError(f"incoming and outgoing cannot be broadcast: make their shapes equal ({error})") from error
    length = np.hypot(np.hypot(array[..., 0], array[..., 1]), array[..., 2])
    valid = np.asarray(np.isfinite(length) & (length > 0))
    if free and valid.shape == (len(free), 2):
        lacking = np.asarray(free, dtype=bool) & np.asarray(np.isnan(array).all(axis=(1, 2)))
        valid = valid | np.stack([lacking, lacking], -1)
    invalid = np.flatnonzero(~valid)
    if len(invalid):
        pair, side = divmod(int(invalid[0]), 2)
        x, y, z = array.reshape(-1, 3)[invalid[0]]
        raise GlimpseError(
            f"the {['incoming', 'outgoing'][side]} vector of pair {pair} is ({x:g}, {y:g}, {z:g}), which has no "
            "direction; pass finite, nonzero vectors"
        )
    return array / length[..., None]


def to_json(value: Any) -> str:
    """Converts numbers, text, lists and arrays."""
    return json.dumps(value, default=lambda array: array.tolist())


def directions_from_degrees(
    theta_i: npt.ArrayLike, phi_i: npt.ArrayLike, theta_o: npt.ArrayLike, phi_o: npt.ArrayLike
) -> npt.NDArray[np.float64]:
    """Converts angles in degrees to unit vectors, float64 of shape (..., 2, 3): the incoming direction from theta_i and
    phi_i, the outgoing one from theta_o and phi_o. Polar angles theta are measured from the normal, and phi is the
    azimuth. Arguments are numbers, or arrays that are broadcast.
    """
    angles = np.broadcast_arrays(*map(np.radians, (theta_i, phi_i, theta_o, phi_o)))
    vectors = [
        np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
        for theta, phi in [angles[:2], angles[2:]]
    ]
    return np.stack(vectors, -2)
