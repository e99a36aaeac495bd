"""Snakemake runs a grid's cells, is killed and goes on; recipes are those of the grid by itself, to the bit.

    python3 tests/interop/workflow.py [TRAINER]

Snakemake is installed from PyPI into an environment of its own in target/.
"""
import json, os, signal, subprocess, sys, tempfile, time, venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = ROOT / "target" / "workflow"
PACKAGES = ["snakemake==9.27.1"]
WORKFLOW = ROOT / "trainer" / "workflow"
GRID = ["train", "--grid", "--model", "phong,linear,neural", "--samples", "1,2,4", "--data", "procedural:20:1",
        "--effort", "brief", "--out", "recipes"]


def snakemake(trainer):
    words = [ENVIRONMENT / "bin" / "python", "-m", "snakemake", "-s", WORKFLOW / "Snakefile",
             "--profile", WORKFLOW / "profiles" / "local", "--config", f"trainer={trainer}", "threads=1"]
    print("== snakemake", flush=True)
    return subprocess.Popen([str(word) for word in words], start_new_session=True,
                            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def finish(process):
    _, talk = process.communicate()
    return process.returncode, talk


def run(*words):
    print("==", *words, flush=True)
    return subprocess.run([str(word) for word in words], check=True, text=True, capture_output=True)


def listed(trainer):
    return [json.loads(line) for line in run(trainer, *GRID, "--list").stdout.splitlines()]


def written(folder):
    return {path.name: path.read_bytes() for path in Path(folder).iterdir() if path.suffix in (".recipe", ".basis")}


def times():
    return {path.name: path.stat().st_mtime_ns for path in Path("recipes").glob("*.recipe")}


def main():
    trainer = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "target/release/trainer").resolve()
    if not (ENVIRONMENT / "bin" / "python").exists():
        venv.create(ENVIRONMENT, with_pip=True)
    subprocess.run([ENVIRONMENT / "bin" / "python", "-m", "pip", "install", "--quiet", *PACKAGES], check=True)
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        run(trainer, *GRID[:-1], "direct")
        direct = written("direct")
        assert len(direct) == 9 + 3, sorted(direct)

        cells = listed(trainer)
        assert len(cells) == 9 and not any(cell["done"] for cell in cells)
        Path("cells.jsonl").write_text("".join(json.dumps(cell) + "\n" for cell in cells))
        # Where a checkpoint's folder should be is a file: this cell fails.
        stone = Path("recipes/phong-n1.recipe.checkpoint")
        stone.write_text("")

        process = snakemake(trainer)
        while len(written("recipes")) < 3 or not any(Path("recipes").glob("*.checkpoint/*")):
            assert process.poll() is None, finish(process)
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        killed = written("recipes")
        print("killed with", len(killed), "files and", len(list(Path("recipes").glob("*.checkpoint/*"))), "checkpoints")
        assert len(killed) < len(direct)

        code, talk = finish(snakemake(trainer))
        assert code != 0 and "phong-n1" in talk, talk
        assert set(direct) - set(written("recipes")) == {"phong-n1.recipe"}, "a cell that fails stopped others"
        stone.unlink()
        code, talk = finish(snakemake(trainer))
        assert code == 0, talk

        assert written("recipes") == direct, "recipes are not those of the grid"
        assert all(cell["done"] for cell in listed(trainer))
        before = times()
        last = run(trainer, *GRID)
        assert times() == before, "recipes were trained again"
        assert len(last.stdout.splitlines()) == 1 + 9, last.stdout
    print("all are the same")


if __name__ == "__main__":
    main()
