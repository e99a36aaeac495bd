"""Tests a grid in Snakemake: it is killed and resumed, and its recipes have the bytes of `trainer train --grid`.

    python3 tests/interop/workflow.py [TRAINER]

Snakemake is installed from PyPI into an environment in target/.
"""
import json, os, signal, subprocess, sys, tempfile, time, venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = ROOT / "target" / "workflow"
PACKAGES = ["snakemake==9.27.1"]
WORKFLOW = ROOT / "trainer" / "workflow"
GRID = ["train", "--grid", "--model", "phong,linear,neural", "--samples", "1,2,4", "--data", "procedural:20:1",
        "--effort", "brief", "--out", "recipes"]


def start_snakemake(trainer):
    command = [ENVIRONMENT / "bin" / "python", "-m", "snakemake", "-s", WORKFLOW / "Snakefile",
               "--profile", WORKFLOW / "profiles" / "local", "--config", f"trainer={trainer}", "threads=1"]
    print("== snakemake", flush=True)
    return subprocess.Popen([str(word) for word in command], start_new_session=True,
                            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def finish(process):
    _, log = process.communicate()
    return process.returncode, log


def run(*command):
    print("==", *command, flush=True)
    return subprocess.run([str(word) for word in command], check=True, text=True, capture_output=True)


def grid_cells(trainer):
    return [json.loads(line) for line in run(trainer, *GRID, "--list").stdout.splitlines()]


def trained_files(folder):
    return {path.name: path.read_bytes() for path in Path(folder).iterdir() if path.suffix in (".recipe", ".basis")}


def modification_times():
    return {path.name: path.stat().st_mtime_ns for path in Path("recipes").glob("*.recipe")}


def main():
    trainer = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "target/release/trainer").resolve()
    if not (ENVIRONMENT / "bin" / "python").exists():
        venv.create(ENVIRONMENT, with_pip=True)
    subprocess.run([ENVIRONMENT / "bin" / "python", "-m", "pip", "install", "--quiet", *PACKAGES], check=True)
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        run(trainer, *GRID[:-1], "direct")
        direct = trained_files("direct")
        assert len(direct) == 9 + 3, sorted(direct)

        cells = grid_cells(trainer)
        assert len(cells) == 9 and not any(cell["done"] for cell in cells)
        Path("cells.jsonl").write_text("".join(json.dumps(cell) + "\n" for cell in cells))
        # A file in place of the checkpoint's folder makes this cell fail.
        obstacle = Path("recipes/phong-n1.recipe.checkpoint")
        obstacle.write_text("")

        process = start_snakemake(trainer)
        while len(trained_files("recipes")) < 3 or not any(Path("recipes").glob("*.checkpoint/*")):
            assert process.poll() is None, finish(process)
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        killed = trained_files("recipes")
        print("killed with", len(killed), "files and", len(list(Path("recipes").glob("*.checkpoint/*"))), "checkpoints")
        assert len(killed) < len(direct)

        code, log = finish(start_snakemake(trainer))
        assert code != 0 and "phong-n1" in log, log
        assert set(direct) - set(trained_files("recipes")) == {"phong-n1.recipe"}, "a failed cell stopped others"
        obstacle.unlink()
        code, log = finish(start_snakemake(trainer))
        assert code == 0, log

        assert trained_files("recipes") == direct, "recipes differ from those of the grid"
        assert all(cell["done"] for cell in grid_cells(trainer))
        before = modification_times()
        last = run(trainer, *GRID)
        assert modification_times() == before, "recipes were trained again"
        assert len(last.stdout.splitlines()) == 1 + 9, last.stdout
    print("all recipes are the same")


if __name__ == "__main__":
    main()
