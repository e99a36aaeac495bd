"""Glimpse: learn a material's BRDF from a handful of readings.

A :class:`Recipe` holds the directions to measure and the method that fits the readings; :func:`train` returns one.
:meth:`Recipe.plan` plans the movement of a machine's arms, and :meth:`Recipe.fit` fits readings to a
:class:`FittedMaterial`. Calling a :class:`Material` with directions returns its BRDF.
:func:`compare` compares materials, and ``glimpse_brdf.plot`` draws them.

Directions are unit vectors from the surface, z along its normal: the incoming one to the light, the outgoing one to
the sensor. Arrays of pairs have the shape (n, 2, 3), incoming first. A BRDF is linear RGB in sr^-1, not times the
cosine, an array (n, 3). The :func:`loss` between two BRDFs is the mean over :func:`directions` and channels of
abs(ln(1 + y cos) - ln(1 + f cos)); ``trainer/docs/results.md`` defines it.

Errors are raised as :class:`GlimpseError`, a ValueError. Missing, inaccessible and existing files raise Python's
FileNotFoundError, PermissionError and FileExistsError.

Computations run on all cores without the GIL. Ctrl-C interrupts a computation. The environment variable
RAYON_NUM_THREADS sets the number of threads.
"""

from . import _glimpse_brdf
from ._glimpse_brdf import *
from ._arrays import directions_from_degrees
from ._results import Plan, Proposals
from .progress import Progress

__all__ = [*_glimpse_brdf.__all__, "Plan", "Progress", "Proposals", "directions_from_degrees"]
