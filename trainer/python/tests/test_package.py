"""Types, docstrings, and the notebook."""

import inspect
import os
import subprocess
import sys
from pathlib import Path

import glimpse_brdf as glimpse
import nbformat
from nbclient import NotebookClient

HERE = Path(__file__).resolve().parent


def run(tmp_path, *words):
    done = subprocess.run([sys.executable, "-m", *words], cwd=tmp_path, text=True, capture_output=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_stubs_are_those_of_the_module(tmp_path):
    run(tmp_path, "mypy.stubtest", "glimpse_brdf")


def test_a_program_of_all_types_passes_a_strict_checker(tmp_path):
    run(tmp_path, "mypy", "--strict", str(HERE / "typed.py"))


def test_everything_has_a_docstring():
    assert glimpse.__doc__ and glimpse.__version__
    for name in glimpse.__all__:
        thing = getattr(glimpse, name)
        assert thing.__doc__, name
        if inspect.isclass(thing):
            for key, member in vars(thing).items():
                if not key.startswith("_") and name not in ("Outlier", "Progress"):
                    assert member.__doc__, (name, key)


def test_the_notebook_runs(tmp_path, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "agg")
    path = HERE.parent / "examples/first_material.ipynb"
    notebook = nbformat.read(path, as_version=4)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert code and not any(cell.outputs or cell.execution_count for cell in code), "clear its outputs"
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": tmp_path}}).execute()
    assert os.path.exists(tmp_path / "velvet.bsdf")
