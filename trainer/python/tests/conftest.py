"""What tests share: the trainer's own program to compare with, and recipes."""

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
# Those that come along with the trainer.
SHIPPED = ROOT / "trainer/recipes"


@pytest.fixture
def trainer(tmp_path):
    """Runs the program in a folder of the test's own: its standard output, or, if it fails, what it says."""

    def run(*words, fails=False):
        command = [str(TRAINER), *map(str, words)]
        done = subprocess.run(command, cwd=tmp_path, text=True, capture_output=True)
        assert (done.returncode != 0) == fails, (command, done.stderr)
        return done.stderr.strip().removeprefix("error: ") if fails else done.stdout

    return run


@pytest.fixture(params=["phong", "cook-torrance", "neural", "completed linear", "completed neural"])
def recipe_path(request, trained, tmp_path):
    """A recipe's file: the models fitted by descent, and what completes readings."""
    kind, _, model = request.param.partition(" ")
    if kind != "completed":
        return RECIPES / f"{kind}-n8.recipe"
    path = tmp_path / f"{model}.recipe"
    trained[model].save(path)
    return path


@pytest.fixture(scope="session")
def trained(tmp_path_factory):
    """Recipes of both kinds that complete readings, trained here in seconds: by model."""
    return {
        model: glimpse.train(model, "procedural:12:3", samples=6, effort="brief", seed=2, missing=0.5)
        for model in ("linear", "neural")
    }


def assert_names(error, *identifiers):
    """Asserts that a message names options, files and numbers, whatever its words are."""
    for identifier in map(str, identifiers):
        assert re.search(rf"(?<!\w){re.escape(identifier)}(?!\w)", str(error)), f"no {identifier} in {error}"


def directions(count, seed=0):
    """Random pairs above the horizon, (count, 2, 3)."""
    vectors = np.random.default_rng(seed).normal(size=(count, 2, 3))
    vectors[..., 2] = np.abs(vectors[..., 2]) + 0.01
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def to_degrees(pairs):
    """theta_i, phi_i, theta_o, phi_o."""
    theta = np.degrees(np.arctan2(np.hypot(pairs[..., 0], pairs[..., 1]), pairs[..., 2]))
    phi = np.degrees(np.arctan2(pairs[..., 1], pairs[..., 0]))
    return np.stack([theta[:, 0], phi[:, 0], theta[:, 1], phi[:, 1]], -1)


def write_csv(path, header, rows):
    lines = [",".join("" if isinstance(x, float) and np.isnan(x) else repr(x) for x in row) for row in rows]
    Path(path).write_text("\n".join([header, *lines]) + "\n")
