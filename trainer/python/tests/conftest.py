"""Shared fixtures and functions: the trainer's program as a reference, and recipes."""

import os
import re
import subprocess
from pathlib import Path

import glimpse_brdf as glimpse
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[3]
TRAINER = Path(os.environ.get("GLIMPSE_TRAINER", ROOT / "target/release/trainer"))
RECIPES = ROOT / "core/examples/recipes"
# Recipes that are bundled with the trainer.
BUNDLED = ROOT / "trainer/recipes"


@pytest.fixture
def trainer(tmp_path):
    """A function that runs the trainer in the test's folder and returns its output, or its error if `fails`."""

    def run(*arguments, fails=False):
        command = [str(TRAINER), *map(str, arguments)]
        process = subprocess.run(command, cwd=tmp_path, text=True, capture_output=True)
        assert (process.returncode != 0) == fails, (command, process.stderr)
        return process.stderr.strip().removeprefix("error: ") if fails else process.stdout

    return run


@pytest.fixture(params=["phong", "cook-torrance", "neural", "completed linear", "completed neural"])
def recipe_path(request, trained, tmp_path):
    """A recipe's file, of each model that is fitted by descent, and of both that complete readings."""
    kind, _, model = request.param.partition(" ")
    if kind != "completed":
        return RECIPES / f"{kind}-n8.recipe"
    path = tmp_path / f"{model}.recipe"
    trained[model].save(path)
    return path


@pytest.fixture(scope="session")
def trained(tmp_path_factory):
    """Recipes by model, of both models that complete readings. They are trained here in seconds."""
    return {
        model: glimpse.train(model, "procedural:12:3", samples=6, effort="brief", seed=2, missing=0.5)
        for model in ("linear", "neural")
    }


def assert_names(error, *identifiers):
    """Asserts that a message names these options, files and numbers. Its other words do not matter."""
    for identifier in map(str, identifiers):
        assert re.search(rf"(?<!\w){re.escape(identifier)}(?!\w)", str(error)), f"no {identifier} in {error}"


def directions(count, seed=0):
    """Random pairs of directions above the horizon, (count, 2, 3)."""
    vectors = np.random.default_rng(seed).normal(size=(count, 2, 3))
    vectors[..., 2] = np.abs(vectors[..., 2]) + 0.01
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def to_degrees(pairs):
    """Converts pairs of directions to theta_i, phi_i, theta_o, phi_o in degrees."""
    theta = np.degrees(np.arctan2(np.hypot(pairs[..., 0], pairs[..., 1]), pairs[..., 2]))
    phi = np.degrees(np.arctan2(pairs[..., 1], pairs[..., 0]))
    return np.stack([theta[:, 0], phi[:, 0], theta[:, 1], phi[:, 1]], -1)


def write_csv(path, header, rows):
    lines = [",".join("" if isinstance(x, float) and np.isnan(x) else repr(x) for x in row) for row in rows]
    Path(path).write_text("\n".join([header, *lines]) + "\n")
