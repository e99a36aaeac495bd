"""The study on a cluster: a worker is killed, a row fails, and what is done is not done again."""

import csv
import importlib.util
import os
import signal
import threading
import time
from pathlib import Path

import glimpse_brdf as glimpse
import pytest
from dask.distributed import LocalCluster

PROGRAM = Path(__file__).resolve().parents[1] / "examples/cluster.py"


@pytest.fixture
def study():
    """The program as a module. It does not hang."""

    def stop(*_):
        raise TimeoutError

    handler = signal.signal(signal.SIGALRM, stop)
    signal.alarm(900)  # only a study that hangs takes so long
    spec = importlib.util.spec_from_file_location("cluster", PROGRAM)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    yield module
    signal.alarm(0)
    signal.signal(signal.SIGALRM, handler)


def kill_a_worker(cluster, folder, killed):
    """Kills a worker as soon as a row has a checkpoint."""
    while not killed and threading.main_thread().is_alive():
        if any(folder.glob("checkpoints/*/checkpoint.bin")):
            worker = next(worker for worker in cluster.workers.values() if worker.process)
            killed.append(worker.process.pid)
            os.kill(worker.process.pid, signal.SIGKILL)
        time.sleep(0.01)


def test_killed_worker_and_failed_row(study, tmp_path, capsys):
    folder, killed = tmp_path / "study", []
    rows = ["--model", "neural", "--schedule", "paper", "--effort", "quick", "--samples", "2", "3"]
    rows += ["--data", "procedural:10", "nowhere/", "--test", "procedural:3:1", "--out", str(folder)]
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        arguments = [*rows, "--scheduler", cluster.scheduler_address]
        killer = threading.Thread(target=kill_a_worker, args=(cluster, folder, killed))
        killer.start()
        assert study.main(arguments) == 1
        killer.join()
        output = capsys.readouterr()
        assert killed and output.err.count("nowhere/") == 2 and output.out.count("loss") == 2
        written = {path: path.stat().st_mtime_ns for path in folder.glob("r*/*") if path.is_file()}
        assert study.main([*arguments, "--data", "procedural:10"]) == 0
        assert all(path.stat().st_mtime_ns == time for path, time in written.items())
    with open(folder / "study.csv") as file:
        table = list(csv.DictReader(file))
    assert [row["samples"] for row in table] == ["2", "3"]
    for row in table:
        # The same bytes as without an interruption, on another number of threads.
        samples = int(row["samples"])
        recipe = glimpse.train("neural", "procedural:10", samples=samples, schedule="paper", effort="quick")
        assert row["checksum"] == recipe.checksum
        assert float(row["loss"]) == glimpse.evaluate(recipe, "procedural:3:1")["loss"]
    recipes = sorted(folder.glob("recipes/*"))
    assert len(recipes) == 2 and glimpse.Recipe.load(recipes[0]).samples == 2
    assert not any((folder / "checkpoints").iterdir())
