"""Glimpse: learn a material's BRDF from a handful of readings.

A :class:`Recipe` says where to measure and how to fit; :func:`train` makes one. Its :meth:`Recipe.plan` says where
the arms of a machine go, its :meth:`Recipe.fit` makes a :class:`FittedMaterial` of what was read there. Every
:class:`Material` is called with directions and answers with its BRDF.

Directions are unit vectors from the surface, z along its normal: the incoming one to the light, the outgoing one to
the sensor. Arrays of pairs have the shape (n, 2, 3), incoming first. A BRDF is linear RGB in sr^-1, not times the
cosine, an array (n, 3). The :func:`loss` between two BRDFs is the mean over :func:`directions` and channels of
abs(ln(1 + y cos) - ln(1 + f cos)); ``trainer/docs/losses.md`` defines it. What goes wrong is raised as :class:`GlimpseError`, a ValueError; files that are missing, may
not be opened, or would be written over, as Python's own FileNotFoundError, PermissionError and FileExistsError.

Work is done on all cores, without the GIL; the environment's RAYON_NUM_THREADS says on how many. Ctrl-C ends it.
"""

from ._glimpse_brdf import (
    FittedMaterial,
    GlimpseError,
    Material,
    Plan,
    Progress,
    Recipe,
    Outlier,
    __version__,
    directions,
    directions_from_degrees,
    evaluate,
    load_material,
    load_materials,
    loss,
    table_directions,
    train,
)

__all__ = [
    "FittedMaterial",
    "GlimpseError",
    "Material",
    "Plan",
    "Progress",
    "Recipe",
    "Outlier",
    "__version__",
    "directions",
    "directions_from_degrees",
    "evaluate",
    "load_material",
    "load_materials",
    "loss",
    "table_directions",
    "train",
]
