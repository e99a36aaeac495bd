"""Training and evaluation: agreement with the trainer's commands, progress, Ctrl-C, checkpoints, other threads."""

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
from glimpse_brdf import Machine


@pytest.mark.parametrize(
    "model, options, arguments",
    [
        ("neural", {}, []),
        ("phong", {"schedule": "paper"}, ["--schedule", "paper"]),
        ("linear", {"schedule": "paper", "bases": 3}, ["--schedule", "paper", "--bases", "3"]),
        (
            "linear",
            {"missing": 0.5, "noise": 0.02, "machine": Machine(max_theta_i_degrees=80, min_separation_degrees=10)},
            ["--missing", "0.5", "--noise", "0.02", "--max-theta-i", "80", "--min-separation", "10"],
        ),
        (
            "linear",
            {"machine": Machine(in_plane=True)},
            ["--in-plane"],
        ),
        (
            "phong",
            {"scan_seconds": 9, "machine": Machine(speed_degrees_per_second=[20, 10, 20, 10], settle_seconds=0.2)},
            ["--scan-seconds", "9", "--speed", "20,10,20,10", "--settle", "0.2"],
        ),
    ],
)
def test_recipe_matches_train_command(trainer, tmp_path, model, options, arguments):
    common = ["--model", model, "--samples", "4", "--data", "procedural:11:6", "--effort", "brief", "--seed", "7"]
    trainer("train", *common, *arguments, "--out", "command.recipe")
    recipe = glimpse.train(model, "procedural:11:6", samples=4, effort="brief", seed=7, **options)
    assert recipe.to_bytes() == (tmp_path / "command.recipe").read_bytes()
    recipe.save(tmp_path / "python.recipe")
    if model == "linear":
        assert (tmp_path / "python.basis").read_bytes() == (tmp_path / "command.basis").read_bytes()
    assert len(recipe.metadata["materials"]) == 11
    trained = recipe.metadata["training"]["options"]
    assert (trained["schedule"], trained["seed"]) == (options.get("schedule", "prior"), 7)
    if "scan_seconds" in options:
        assert recipe.plan().seconds.max() <= 9
        assert recipe.plan().order == "progressive"
    if "noise" in options:
        assert trained["noise"] == pytest.approx(0.02)
        assert trained["limits"]["max_theta_i_degrees"] == 80
        assert (recipe.angles_degrees[:, 0] < 80.01).all()
    with pytest.raises(TypeError, match="limits"):
        glimpse.train(model, limits=3)


def test_pattern_keeps_directions():
    pairs = glimpse.directions_from_degrees([45, 20], 0, [30, 20], 180)
    recipe = glimpse.train("linear", "procedural:11:6", samples=3, effort="brief", pattern=pairs)
    np.testing.assert_allclose(recipe.directions[:2, :, 2], pairs[..., 2], atol=1e-5)
    with pytest.raises(glimpse.GlimpseError):
        glimpse.train("linear", "procedural:11:6", samples=1, effort="brief", pattern=pairs)


def test_progress_is_called_and_its_exception_stops_training():
    reports = []
    glimpse.train("phong", "procedural:10", samples=2, schedule="paper", effort="brief", progress=reports.append)
    done = [progress.done for progress in reports]
    assert len(reports) > 2 and done == sorted(set(done)) and done[-1] == reports[-1].total
    last = reports[-1]
    assert last.samples == 2 and np.isfinite(last.loss) and isinstance(last.phase, str) and "loss" in repr(last)

    def stop(progress):
        raise LookupError("enough")

    start = time.monotonic()
    with pytest.raises(LookupError, match="enough"):
        glimpse.train("neural", "procedural:20", effort="long", progress=stop)
    assert time.monotonic() - start < 30


def test_bar_is_drawn_in_a_terminal_only(monkeypatch, capsys):
    from glimpse_brdf import progress

    assert progress.bar() is None
    options = {"samples": 2, "schedule": "paper", "effort": "brief"}
    glimpse.train("phong", "procedural:10", **options)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    glimpse.train("phong", "procedural:10", progress=False, **options)
    assert capsys.readouterr().err == ""
    glimpse.train("phong", "procedural:10", **options)
    drawn = capsys.readouterr().err
    assert "loss" in drawn and len(drawn.split("\r")) > 1


def test_resumed_run_gives_same_bytes(tmp_path):
    options = {"samples": 3, "schedule": "paper", "effort": "brief", "seed": 3}
    uninterrupted = glimpse.train("phong", "procedural:10", **options)
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
    reports = []
    options.update(checkpoint=folder, resume=True, progress=reports.append)
    resumed = glimpse.train("phong", "procedural:10", **options)
    assert resumed == uninterrupted and reports[0].done > 1 and not folder.exists()


FORK_SCRIPT = """
    import multiprocessing, sys
    from concurrent.futures import ProcessPoolExecutor
    import glimpse_brdf as glimpse

    def work(threads):
        recipe = glimpse.train("linear", "procedural:12:3", samples=4, effort="brief", seed=2, threads=threads)
        material, pairs = glimpse.load_material("procedural:1:9"), glimpse.directions()[::13]
        fitted = glimpse.Recipe.load("linear-any").fit(material(pairs[::160]), pairs[::160])
        glimpse.evaluate(recipe, material, threads=threads)
        return recipe.to_bytes(), fitted.parameters.tobytes(), fitted.deviation(pairs).tobytes()

    expected = work(None)
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("fork")) as processes:
        for result in processes.map(work, [None, 1, 3]):
            assert result == expected
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
def test_forked_processes_compute_the_same():
    """Threads do not survive a fork: with those of the parent, the children would wait forever."""
    subprocess.run([sys.executable, "-c", textwrap.dedent(FORK_SCRIPT)], check=True, timeout=300)


TRAINING_SCRIPT = """
    import sys, time
    import glimpse_brdf as glimpse

    def report(progress):
        if progress.done > 3 and not reports:
            reports.append(progress.done)
            print("ready", flush=True)

    reports = []
    try:
        glimpse.train("neural", "procedural:40", effort="long", checkpoint=sys.argv[1], progress=report)
    except KeyboardInterrupt:
        print("interrupted", flush=True)
"""


def test_ctrl_c_stops_training_and_saves_checkpoint(tmp_path):
    command = [sys.executable, "-c", textwrap.dedent(TRAINING_SCRIPT), str(tmp_path / "run")]
    with subprocess.Popen(command, text=True, stdout=subprocess.PIPE) as process:
        assert process.stdout.readline() == "ready\n"
        start = time.monotonic()
        os.kill(process.pid, signal.SIGINT)
        assert process.stdout.readline() == "interrupted\n"
        seconds = time.monotonic() - start
        process.wait()
    print(f"stopped after {seconds:.2f} s")
    assert seconds < 2
    assert (tmp_path / "run/checkpoint.bin").exists()


def test_ctrl_c_stops_evaluation():
    code = """
        import glimpse_brdf as glimpse, os, signal, threading, time
        recipe = glimpse.train("phong", "procedural:4", samples=2, schedule="paper", effort="brief")
        threading.Timer(4, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
        try:
            glimpse.evaluate(recipe, "procedural:20", noise=0.1, seeds=10_000)
        except KeyboardInterrupt:
            print("interrupted")
    """
    start = time.monotonic()
    process = subprocess.run([sys.executable, "-c", textwrap.dedent(code)], text=True, capture_output=True)
    assert process.stdout == "interrupted\n", process.stderr
    # Without Ctrl-C, the evaluation takes hours.
    assert time.monotonic() - start < 120


def test_other_threads_run_during_training():
    ticks, finished = [], threading.Event()

    def tick():
        while not finished.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.005)

    thread = threading.Thread(target=tick)
    thread.start()
    start = time.monotonic()
    glimpse.train("neural", "procedural:10", samples=4, schedule="paper", effort="brief")
    end = time.monotonic()
    finished.set()
    thread.join()
    during_training = [tick_time for tick_time in ticks if start < tick_time < end]
    longest_gap = np.diff([start, *during_training, end]).max()
    assert len(during_training) > 10 and longest_gap < 1


def test_trains_on_material_objects(tmp_path):
    tables = [
        glimpse.Material.from_function(lambda i, o, k=k: np.full((len(i), 3), 0.02 * (k + 1)), f"gray-{k}")
        for k in range(3)
    ]
    recipe = glimpse.train("phong", tables, samples=2, effort="brief", schedule="paper")
    assert [material["name"] for material in recipe.metadata["materials"]] == ["gray-0", "gray-1", "gray-2"]
    assert recipe.metadata["training"]["data"] == "3 materials of a program"
    # Training on files of the same tables gives the same pattern.
    for table in tables:
        table.save(tmp_path / f"{table.name}.binary")
    from_files = glimpse.train("phong", tmp_path, samples=2, effort="brief", schedule="paper")
    np.testing.assert_array_equal(from_files.directions, recipe.directions)
    mixed = glimpse.train("linear", ["procedural:8", *tables], samples=2, effort="brief", share=[1, 3])
    assert len(mixed.metadata["materials"]) == 11
    report = glimpse.evaluate(recipe, [tables[0], "procedural:2:9"])
    assert report["trained_on"] == ["gray-0"] and report["namesakes_trained_on"] == []


def test_evaluate_matches_command(trainer, tmp_path, trained):
    recipe = trained["neural"]
    recipe.save(tmp_path / "a.recipe")
    for options, arguments in [
        ({}, []),
        (
            {"first": 4, "noise": 0.05, "seeds": 2, "seed": 3},
            ["--first", 4, "--noise", 0.05, "--seeds", 2, "--seed", 3],
        ),
    ]:
        command = ["evaluate", "--recipe", "a.recipe", "--test", "procedural:5:8", "--json", *arguments]
        expected = json.loads(trainer(*command))
        report = glimpse.evaluate(recipe, "procedural:5:8", **options)
        for key in ["method", "model", "samples", "seeds", "trained_on", "namesakes_trained_on"]:
            assert report[key] == expected[key], key
        for key in ["loss", "dssim", "l2", "psnr", "delta_e", "loss_standard_error", "loss_spread"]:
            assert report[key] == pytest.approx(expected[key], rel=1e-9), key
        assert len(report["materials"]) == len(expected["materials"])
        for a, b in zip(report["materials"], expected["materials"]):
            assert a["name"] == b["name"] and a["loss"] == pytest.approx(b["loss"], rel=1e-9)
            assert a["delta_e"] == pytest.approx(b["delta_e"], rel=1e-9) and a["delta_e"] > 0


def test_compare_matches_command(trainer):
    printed = json.loads(trainer("compare", "procedural:1:3", "procedural:2:8", "--json"))
    rows = glimpse.compare(glimpse.load_material("procedural:1:3"), "procedural:2:8")
    assert [row["name"] for row in rows] == [row["material"] for row in printed["materials"]]
    for row, expected in zip(rows, printed["materials"]):
        for key in ["loss", "dssim", "l2", "psnr", "delta_e"]:
            assert row[key] == pytest.approx(expected[key], rel=1e-9), key
    (same,) = glimpse.compare(glimpse.load_material("procedural:1:3"), "procedural:1:3")
    assert same["loss"] == 0 and same["delta_e"] == 0


def test_rejects_invalid_training():
    def train_error(*args, **options):
        with pytest.raises(glimpse.GlimpseError) as error:
            glimpse.train(*args, **options)
        # Messages name Python's parameters, not options of the command line.
        assert "--" not in str(error.value)
        return str(error.value)

    assert_names(train_error("phong", missing=1.5), "missing", 1.5)
    assert_names(train_error("disney"), "phong", "cook-torrance", "linear", "neural")
    assert_names(train_error("phong", "procedural:3", samples=0), 0)
    assert_names(train_error("phong", schedule="paper", missing=0.5), "missing")
    assert_names(train_error("phong", schedule="paper", bases=3), "bases")
    assert_names(train_error("linear", schedule="paper", eta=-1), "eta")
    assert_names(train_error("phong", resume=True), "resume")
    assert_names(train_error("phong", machine=Machine(settle_seconds=1)), "settle_seconds", "scan_seconds")
    assert_names(train_error("phong", schedule="paper", scan_seconds=9), "scan_seconds")
    assert_names(train_error("phong", "procedural:3", samples=4, scan_seconds=2), 4, 2)
    assert_names(train_error("phong", share=[1]), "share")
    for share in ([1], [1, 0]):
        assert_names(train_error("phong", ["procedural:2", "procedural:3"], share=share), "share")
    assert_names(train_error("phong", ["procedural:2", "procedural:2"]), "procedural:2")
    train_error("phong", [])
    assert_names(train_error("phong", effort="hasty"), "brief", "quick")
    assert "max_theta_i" in train_error("phong", machine=Machine(max_theta_i_degrees=95))
    message = train_error("phong", machine=Machine(max_theta_i_degrees=30, min_separation_degrees=80))
    assert_names(message, "min_separation_degrees", "max_theta_i_degrees", "60.0")
    with pytest.raises(FileNotFoundError):
        glimpse.train("phong", "nowhere/")
    with pytest.raises(TypeError):
        glimpse.train("phong", 3)
    with pytest.raises(TypeError):
        glimpse.train("phong", [None])
    assert_names(train_error("phong", samples=-1), "samples", -1)
    recipe = glimpse.train("phong", "procedural:3", samples=2, schedule="paper", effort="brief")
    with pytest.raises(glimpse.GlimpseError) as error:
        glimpse.evaluate(recipe, "procedural:2", first=1)
    assert "missing" in str(error.value) and "--" not in str(error.value)
    with pytest.raises(glimpse.GlimpseError, match="lose"):
        glimpse.evaluate(recipe, "procedural:2", lose=2)
    with pytest.raises(glimpse.GlimpseError, match="noise"):
        glimpse.evaluate(recipe, "procedural:2", noise=-1)
