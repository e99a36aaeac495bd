"""Plots with matplotlib, which must be installed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Optional, Sequence

import numpy as np

from . import Material, Plan, directions_from_degrees

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.projections.polar import PolarAxes

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def lobes(
    materials: Sequence[Material], theta_i_degrees: float = 45.0, axes: Optional[PolarAxes] = None
) -> PolarAxes:
    """Plots the luminance of BRDFs in the plane of incidence, in sr^-1 (not times the cosine) on a logarithmic radius.

    The angle is the sensor's polar angle, positive on the side opposite the light. Returns the axes.
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
        axes.plot(np.radians(theta_o), np.maximum(luminance, 1e-4), label=material.name)
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    axes.set_thetamin(-90)
    axes.set_thetamax(90)
    axes.set_rscale("log")
    axes.legend(loc="lower center")
    return axes


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
