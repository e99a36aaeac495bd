"""Plots with matplotlib, which must be installed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Optional, Sequence

import numpy as np

from . import FittedMaterial, Material, Plan, directions_from_degrees

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.projections.polar import PolarAxes

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
# The smallest plotted BRDF, sr^-1.
_MIN_BRDF = 1e-4
# The largest distance of a plotted reading from the plane of incidence, and of its light from that of the plot.
_MAX_DISTANCE_DEGREES = 2.0


def lobes(
    materials: Sequence[Material], theta_i_degrees: float = 45.0, axes: Optional[PolarAxes] = None
) -> PolarAxes:
    """Plots the luminance of BRDFs in the plane of incidence, in sr^-1 (not times the cosine) on a logarithmic radius.

    The angle is the sensor's polar angle, positive on the side opposite the light. A fitted material has a band of one
    standard deviation, and its readings with light or sensor within 2 degrees of `theta_i_degrees`, as discs; those that
    the fit did not use are circles. Returns the axes.
    """
    if axes is None:
        import matplotlib.pyplot as plt

        figure = plt.figure()
        created: PolarAxes = figure.add_subplot(projection="polar")  # type: ignore[assignment]
        axes = created
    theta_o = np.linspace(-89.5, 89.5, 359)
    pairs = directions_from_degrees(theta_i_degrees, 180.0, np.abs(theta_o), np.where(theta_o < 0, 180.0, 0.0))
    for material in materials:
        luminance = material(pairs) @ _LUMINANCE
        (line,) = axes.plot(np.radians(theta_o), np.maximum(luminance, _MIN_BRDF), label=material.name)
        if isinstance(material, FittedMaterial):
            deviation = material.deviation(pairs) @ _LUMINANCE
            bounds = [np.maximum(luminance + sign * deviation, _MIN_BRDF) for sign in (-1, 1)]
            axes.fill_between(np.radians(theta_o), *bounds, color=line.get_color(), alpha=0.18, linewidth=0)
            _mark_readings(material, theta_i_degrees, axes, line.get_color())
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    axes.set_thetamin(-90)
    axes.set_thetamax(90)
    axes.set_rscale("log")
    axes.legend(loc="lower center")
    return axes


def _mark_readings(material: FittedMaterial, theta_i_degrees: float, axes: PolarAxes, color: Any) -> None:
    """Marks the readings near a light in the plane of incidence."""
    theta = np.degrees(np.arccos(np.clip(material.directions[..., 2], -1, 1)))
    x, y = material.directions[..., 0], material.directions[..., 1]
    # The sine of the smaller polar angle, times that of the difference of azimuths.
    from_plane = np.abs(x[:, 0] * y[:, 1] - y[:, 0] * x[:, 1]) / np.maximum(np.hypot(x, y).max(axis=1), 1e-9)
    # Light and sensor may be exchanged.
    light = np.abs(theta - theta_i_degrees).argmin(axis=1)
    distance = np.abs(theta - theta_i_degrees).min(axis=1)
    near = (distance <= _MAX_DISTANCE_DEGREES) & (from_plane <= np.sin(np.radians(_MAX_DISTANCE_DEGREES)))
    side = np.where((x * x[:, ::-1] + y * y[:, ::-1])[:, 0] > 0, -1, 1)
    theta_o = side * theta[np.arange(len(theta)), 1 - light]
    values = np.maximum(material.readings @ _LUMINANCE, _MIN_BRDF)
    used = np.ones(len(theta), dtype=bool)
    used[[unused["sample"] for unused in material.report["readings"]["unused"]]] = False
    for shown, face in [(near & used, color), (near & ~used, "none")]:
        axes.scatter(np.radians(theta_o[shown]), values[shown], s=16 if near.sum() <= 60 else 4, facecolors=face, edgecolors=color, zorder=3)


def plan(route: Plan, axes: Optional[Axes] = None) -> Axes:
    """Plots the polar angles and the difference of azimuths, in degrees, over the seconds of a scan. Returns the axes."""
    if axes is None:
        import matplotlib.pyplot as plt

        axes = plt.figure().add_subplot()
    theta_i, phi_i, theta_o, phi_o = route.angles_degrees.T
    for values, label in [(theta_i, "theta_i"), (theta_o, "theta_o"), ((phi_o - phi_i) % 360, "phi_o - phi_i")]:
        axes.plot(route.seconds, values, marker="o", label=label)
    axes.set_xlabel("seconds")
    axes.set_ylabel("degrees")
    axes.legend()
    return axes
