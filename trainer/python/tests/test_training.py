"""Training and judging: the commands' bytes and numbers, progress, Ctrl-C, checkpoints, other threads."""

import json
import os
import signal
import subprocess
import sys
import textwrap
import threading
import time

import glimpse_brdf as glimpse
import numpy as np
import pytest
from conftest import assert_names


@pytest.mark.parametrize(
    "model, options, words",
    [
        ("neural", {}, []),
        ("phong", {"schedule": "joint"}, ["--schedule", "joint"]),
        ("linear", {"schedule": "paper", "bases": 3}, ["--schedule", "paper", "--bases", "3"]),
        (
            "linear",
            {"missing": 0.5, "noise": 0.02, "max_theta_i_degrees": 80, "min_separation_degrees": 10},
            ["--missing", "0.5", "--noise", "0.02", "--max-theta-i", "80", "--min-separation", "10"],
        ),
    ],
)
def test_a_recipe_is_the_trainers_to_the_bit(trainer, tmp_path, model, options, words):
    common = ["--model", model, "--samples", "4", "--data", "procedural:11:6", "--effort", "brief", "--seed", "7"]
    trainer("train", *common, *words, "--out", "theirs.recipe")
    recipe = glimpse.train(model, "procedural:11:6", samples=4, effort="brief", seed=7, **options)
    assert recipe.to_bytes() == (tmp_path / "theirs.recipe").read_bytes()
    recipe.save(tmp_path / "ours.recipe")
    if model == "linear":
        assert (tmp_path / "ours.basis").read_bytes() == (tmp_path / "theirs.basis").read_bytes()
    assert len(recipe.trained_on) == 11
    if "noise" in options:
        assert recipe.noise["relative"] == pytest.approx(0.02)
        assert recipe.limits["max_theta_i_degrees"] == pytest.approx(80)
        assert (recipe.angles_degrees[:, 0] < 80.01).all()
    else:
        assert recipe.noise is None and recipe.limits is None


def test_progress_is_told_and_what_it_raises_ends_the_run():
    told = []
    glimpse.train("phong", "procedural:10", samples=2, schedule="joint", effort="brief", progress=told.append)
    done = [progress.done for progress in told]
    assert len(told) > 2 and done == sorted(set(done)) and done[-1] == told[-1].total
    last = told[-1]
    assert last.samples == 2 and np.isfinite(last.loss) and isinstance(last.phase, str) and "loss" in repr(last)

    def stop(progress):
        raise LookupError("enough")

    begin = time.monotonic()
    with pytest.raises(LookupError, match="enough"):
        glimpse.train("neural", "procedural:20", effort="long", progress=stop)
    assert time.monotonic() - begin < 30


def test_a_run_that_was_ended_goes_on_to_the_same_bytes(tmp_path):
    options = {"samples": 3, "schedule": "joint", "effort": "brief", "seed": 3}
    whole = glimpse.train("phong", "procedural:10", **options)
    folder = tmp_path / "run"

    def stop(progress):
        raise LookupError

    with pytest.raises(LookupError):
        glimpse.train("phong", "procedural:10", checkpoint=folder, progress=stop, **options)
    assert (folder / "checkpoint.bin").exists()
    with pytest.raises(glimpse.GlimpseError, match="resume"):
        glimpse.train("phong", "procedural:10", checkpoint=folder, **options)
    with pytest.raises(glimpse.GlimpseError, match="checkpoint.bin"):
        glimpse.train("phong", "procedural:11", checkpoint=folder, resume=True, **options)
    told = []
    again = glimpse.train("phong", "procedural:10", checkpoint=folder, resume=True, progress=told.append, **options)
    assert again == whole and told[0].done > 1 and not folder.exists()


INTERRUPTED = """
    import sys, time
    import glimpse_brdf as glimpse

    def tell(progress):
        if progress.done > 3 and not told:
            told.append(progress.done)
            print("ready", flush=True)

    told = []
    try:
        glimpse.train("neural", "procedural:40", effort="long", checkpoint=sys.argv[1], progress=tell)
    except KeyboardInterrupt:
        print("interrupted", flush=True)
"""


def test_ctrl_c_ends_a_run_at_once_and_leaves_a_checkpoint(tmp_path):
    words = [sys.executable, "-c", textwrap.dedent(INTERRUPTED), str(tmp_path / "run")]
    with subprocess.Popen(words, text=True, stdout=subprocess.PIPE) as process:
        assert process.stdout.readline() == "ready\n"
        begin = time.monotonic()
        os.kill(process.pid, signal.SIGINT)
        assert process.stdout.readline() == "interrupted\n"
        seconds = time.monotonic() - begin
        process.wait()
    print(f"ended after {seconds:.2f} s")
    assert seconds < 2
    assert (tmp_path / "run/checkpoint.bin").exists()


def test_ctrl_c_ends_a_judgment():
    code = """
        import glimpse_brdf as glimpse, os, signal, threading, time
        recipe = glimpse.train("phong", "procedural:4", samples=2, schedule="joint", effort="brief")
        threading.Timer(4, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
        try:
            glimpse.evaluate(recipe, "procedural:20", noise=0.1, seeds=10_000)
        except KeyboardInterrupt:
            print("interrupted")
    """
    begin = time.monotonic()
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(code)], text=True, capture_output=True)
    assert done.stdout == "interrupted\n", done.stderr
    # It would take hours.
    assert time.monotonic() - begin < 120


def test_other_threads_run_meanwhile():
    ticks, over = [], threading.Event()

    def tick():
        while not over.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.005)

    thread = threading.Thread(target=tick)
    thread.start()
    begin = time.monotonic()
    glimpse.train("neural", "procedural:10", samples=4, schedule="joint", effort="brief")
    end = time.monotonic()
    over.set()
    thread.join()
    inside = [at for at in ticks if begin < at < end]
    longest = np.diff([begin, *inside, end]).max()
    assert len(inside) > 10 and longest < 1


def test_arrays_to_train_on(tmp_path):
    tables = [
        glimpse.Material.from_function(lambda i, o, k=k: np.full((len(i), 3), 0.02 * (k + 1)), f"gray-{k}")
        for k in range(3)
    ]
    recipe = glimpse.train("phong", tables, samples=2, effort="brief", schedule="joint")
    assert recipe.trained_on == ["gray-0", "gray-1", "gray-2"]
    assert recipe.provenance["data"] == "3 materials of a program"
    # The very same tables in a folder of files are the same materials.
    for table in tables:
        table.save(tmp_path / f"{table.name}.binary")
    again = glimpse.train("phong", tmp_path, samples=2, effort="brief", schedule="joint")
    np.testing.assert_array_equal(again.directions, recipe.directions)
    mixed = glimpse.train("linear", ["procedural:8", *tables], samples=2, effort="brief", share=[1, 3])
    assert len(mixed.trained_on) == 11
    verdict = glimpse.evaluate(recipe, [tables[0], "procedural:2:9"])
    assert verdict["trained_on"] == ["gray-0"] and verdict["namesakes_trained_on"] == []


def test_a_judgment_is_the_trainers(trainer, tmp_path, trained):
    recipe = trained["neural"]
    recipe.save(tmp_path / "a.recipe")
    for options, words in [
        ({}, []),
        ({"first": 4, "noise": 0.05, "seeds": 2, "seed": 3}, ["--first", 4, "--noise", 0.05, "--seeds", 2, "--seed", 3]),
    ]:
        told = json.loads(trainer("evaluate", "--recipe", "a.recipe", "--test", "procedural:5:8", "--json", *words))
        found = glimpse.evaluate(recipe, "procedural:5:8", **options)
        for key in ["method", "model", "samples", "seeds", "trained_on", "namesakes_trained_on"]:
            assert found[key] == told[key], key
        for key in ["loss", "dssim", "l2", "psnr", "delta_e", "loss_standard_error", "loss_spread"]:
            assert found[key] == pytest.approx(told[key], rel=1e-9), key
        for one, other in zip(found["materials"], told["materials"], strict=True) if sys.version_info >= (3, 10) else ():
            assert one["name"] == other["name"] and one["loss"] == pytest.approx(other["loss"], rel=1e-9)
            assert one["delta_e"] == pytest.approx(other["delta_e"], rel=1e-9) and one["delta_e"] > 0


def test_what_cannot_be_trained():
    def refusal(*args, **options):
        with pytest.raises(glimpse.GlimpseError) as error:
            glimpse.train(*args, **options)
        # Nothing of the command line.
        assert "--" not in str(error.value)
        return str(error.value)

    assert_names(refusal("phong", missing=1.5), "missing", 1.5)
    assert_names(refusal("disney"), "phong", "cook-torrance", "linear", "neural")
    assert_names(refusal("phong", "procedural:3", samples=0), 0)
    assert_names(refusal("phong", schedule="joint", missing=0.5), "missing")
    assert_names(refusal("phong", schedule="joint", bases=3), "bases")
    assert_names(refusal("linear", schedule="joint", eta=-1), "eta")
    assert_names(refusal("phong", resume=True), "resume")
    assert_names(refusal("phong", share=[1]), "share")
    for share in ([1], [1, 0]):
        assert_names(refusal("phong", ["procedural:2", "procedural:3"], share=share), "share")
    assert_names(refusal("phong", ["procedural:2", "procedural:2"]), "procedural:2")
    refusal("phong", [])
    assert_names(refusal("phong", effort="hasty"), "brief", "quick")
    assert "max_theta_i" in refusal("phong", max_theta_i_degrees=95)
    far = refusal("phong", max_theta_i_degrees=30, min_separation_degrees=80)
    assert_names(far, "min_separation_degrees", "max_theta_i_degrees", "60.0")
    with pytest.raises(FileNotFoundError):
        glimpse.train("phong", "nowhere/")
    with pytest.raises(TypeError):
        glimpse.train("phong", 3)
    with pytest.raises(TypeError):
        glimpse.train("phong", [None])
    with pytest.raises(OverflowError):
        glimpse.train("phong", samples=-1)
    recipe = glimpse.train("phong", "procedural:3", samples=2, schedule="joint", effort="brief")
    with pytest.raises(glimpse.GlimpseError) as error:
        glimpse.evaluate(recipe, "procedural:2", first=1)
    assert "missing" in str(error.value) and "--" not in str(error.value)
    with pytest.raises(glimpse.GlimpseError, match="lose"):
        glimpse.evaluate(recipe, "procedural:2", lose=2)
    with pytest.raises(glimpse.GlimpseError, match="noise"):
        glimpse.evaluate(recipe, "procedural:2", noise=-1)
