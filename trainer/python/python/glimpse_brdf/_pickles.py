"""Pickles of recipes: bundled ones by name, and others with a compressed basis."""

import zlib
from typing import Any, Callable, Optional

import numpy as np

from . import GlimpseError, Recipe

# Bytes before the scales of the components, and before the entries of a component at a node (core/docs/basis.md).
_HEADER, _NODE_HEADER = 30, 4


def reduce(recipe: Recipe, bundled: Optional[str]) -> tuple[Callable[..., Recipe], tuple[Any, ...]]:
    """Returns a function and arguments that restore a recipe, from its name if it is bundled."""
    if bundled is not None:
        return restore_bundled, (bundled, recipe.checksum)
    return restore, (recipe.to_bytes(), pack(recipe.basis_bytes()))


def restore_bundled(name: str, checksum: str) -> Recipe:
    """Returns a bundled recipe, if it is the pickled one."""
    recipe = Recipe._bundled(checksum)  # type: ignore[attr-defined]
    if recipe is None:
        raise GlimpseError(
            f"this version does not bundle the pickled recipe {name}, {checksum}: install the version that pickled it, or "
            "exchange the recipe by `save` and `load`"
        )
    return recipe


def pack(basis: Optional[bytes]) -> Optional[tuple[bytes, bytes]]:
    """Compresses the file of a basis to about a quarter: neighbors along phi_d differ little in each component. A tenth
    of the bytes more could be saved in twenty times the time, because the entries are rounded to 8 bits for each node.
    """
    if basis is None:
        return None
    shape = _shape(basis)
    end = _HEADER + 4 * (shape[3] - _NODE_HEADER)
    nodes = np.frombuffer(basis, np.uint8, offset=end).reshape(shape)
    columns = nodes.transpose(3, 0, 1, 2).copy()
    columns[..., 1:] -= columns[..., :-1].copy()
    return basis[:end], zlib.compress(columns.tobytes(), 4)


def restore(recipe: bytes, packed: Optional[tuple[bytes, bytes]]) -> Recipe:
    """Returns the recipe of bytes, with its basis from `pack`."""
    if packed is None:
        return Recipe(recipe)
    header, compressed = packed
    shape = _shape(header)
    differences = np.frombuffer(zlib.decompress(compressed), np.uint8).reshape(shape[3], *shape[:3])
    nodes = np.add.accumulate(differences, axis=-1, dtype=np.uint8).transpose(1, 2, 3, 0)
    return Recipe(recipe, header + nodes.tobytes())


def _shape(header: bytes) -> tuple[int, int, int, int]:
    """Returns the numbers of nodes along theta_h, theta_d and phi_d, and of the bytes of each."""
    components, *nodes = np.frombuffer(header, "<u2", 4, 18).tolist()
    return nodes[0], nodes[1], nodes[2], _NODE_HEADER + components
