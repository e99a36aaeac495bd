"""Types, docstrings, and the notebook."""

import inspect
import os
import subprocess
import sys
from pathlib import Path

import glimpse_brdf as glimpse
import nbformat
import numpy as np
import pytest
from glimpse_brdf import plot
from nbclient import NotebookClient

HERE = Path(__file__).resolve().parent


def run_module(tmp_path, *arguments):
    process = subprocess.run([sys.executable, "-m", *arguments], cwd=tmp_path, text=True, capture_output=True)
    assert process.returncode == 0, process.stdout + process.stderr


def test_stubs_match_module(tmp_path):
    run_module(tmp_path, "mypy.stubtest", "glimpse_brdf")


def test_types_pass_strict_checking(tmp_path):
    run_module(tmp_path, "mypy", "--strict", str(HERE / "typed.py"))


def test_types_pass_pyright(tmp_path):
    run_module(tmp_path, "pyright", "--pythonpath", sys.executable, str(HERE / "typed.py"))


def test_plots_have_a_curve_for_each_material_and_angle(monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "agg")
    materials = glimpse.load_materials("procedural:2:9")
    axes = plot.lobes(materials, 30)
    assert [line.get_label() for line in axes.lines] == [material.name for material in materials]
    route = glimpse.train("phong", "procedural:3", samples=2, schedule="paper", effort="brief").plan()
    assert len(plot.plan(route).lines) == 3
    # A fit has a band, and marks for its readings in the plane, used or not.
    pairs = glimpse.directions_from_degrees(45, 0, [0, 20, 50, 30], [0, 180, 180, 90])
    fitted = glimpse.Recipe.load("linear-any").fit(materials[0](pairs), pairs)
    np.testing.assert_allclose(fitted.readings, materials[0](pairs), rtol=1e-6)
    band, used, unused = plot.lobes([fitted]).collections
    marks = np.degrees(np.concatenate([used.get_offsets(), unused.get_offsets()])[:, 0])
    np.testing.assert_allclose(sorted(marks), [0, 20, 50], atol=0.01)
    assert band.get_facecolor()[0, 3] < 1


def test_public_items_have_docstrings():
    assert glimpse.__doc__ and glimpse.__version__
    for name in glimpse.__all__:
        item = getattr(glimpse, name)
        assert item.__doc__, name
        if inspect.isclass(item):
            for key, member in vars(item).items():
                if not key.startswith("_") and name != "Progress":
                    assert member.__doc__, (name, key)


NOTEBOOKS = {"first_material": "red-paint.bsdf", "next_reading": "red-paint.json", "paint_laboratory": "red-paint_rgb.bsdf"}


@pytest.mark.parametrize("name, result", NOTEBOOKS.items())
def test_notebook_runs(tmp_path, monkeypatch, name, result):
    monkeypatch.setenv("MPLBACKEND", "agg")
    path = HERE.parent / f"examples/{name}.ipynb"
    notebook = nbformat.read(path, as_version=4)
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert cells and not any(cell.outputs or cell.execution_count for cell in cells), "clear the notebook's outputs"
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": tmp_path}}).execute()
    assert os.path.exists(tmp_path / result)


def test_saved_notebook_has_one_line_of_a_training():
    source = "import glimpse_brdf\nglimpse_brdf.train('phong', 'procedural:10', samples=2, effort='brief').samples"
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(source)])
    NotebookClient(notebook, timeout=300).execute()
    progress, result = notebook.cells[0].outputs
    assert (progress.output_type, result.data["text/plain"]) == ("display_data", "2")
