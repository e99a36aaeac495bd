"""Trains and evaluates every combination of the given values, on all cores of this machine or on a cluster.

A combination is a row of the table OUT/study.csv, and its recipe is in OUT/recipes. The same command computes
only what is missing, and continues unfinished trainings, also after a worker was killed. A row that fails is reported,
and the others go on. The exit status is 1 if rows failed. All workers see the same folders of materials and results.
Use another OUT after a change of the materials or of the module.

    pip install 'glimpse-brdf[cluster]'
    python cluster.py --data MERL-train/ --test MERL-test/ --effort standard --out study/

Without other options, the rows are the columns "the paper's" and "Glimpse" of `trainer reproduce losses`, with the same
numbers on the same kind of processor, and the same seed and efforts.
"""

import argparse
import csv
import fcntl
import itertools
import json
import os
import sys
import uuid
import zlib
from pathlib import Path

import glimpse_brdf as glimpse
from dask.distributed import Client, as_completed

RESULTS = ["checksum", "loss", "loss_standard_error", "dssim", "l2", "psnr", "delta_e"]


def parse(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add, models = parser.add_argument, ["phong", "cook-torrance", "linear", "neural"]
    add("--out", type=Path, default="study", help="folder of the results [study]")
    add("--model", nargs="+", choices=models, default=models, help="[all four]")
    add("--schedule", nargs="+", choices=["paper", "prior"], default=["paper", "prior"], help="[both]")
    add("--samples", nargs="+", type=int, default=[8], help="numbers of samples [8]")
    add("--effort", nargs="+", default=["quick"], help="brief, quick, standard or long [quick]")
    add("--seed", nargs="+", type=int, default=[0], help="seeds of all random choices [0]")
    add("--data", nargs="+", type=source, default=["procedural:100"], help="training materials [procedural:100]")
    add("--test", nargs="+", type=source, default=["procedural:20:1"], help="test materials [procedural:20:1]")
    add("--options", type=json.loads, default={}, help='other options of train as JSON: \'{"missing": 0.5}\'')
    add("--scheduler", help="address of a Dask scheduler, tcp://HOST:PORT [workers on all cores of this machine]")
    add("--threads", type=int, default=1, help="threads of a row: a worker's cores divided by its Dask threads [1]")
    args = parser.parse_args(arguments)
    if not isinstance(args.options, dict) or not args.options.keys().isdisjoint(vars(args)):
        parser.error("--options must be a JSON object of other options than those of this program")
    return args


def source(text):
    """Makes a path absolute: workers have other working folders."""
    return str(Path(text).resolve()) if Path(text).exists() else text


def rows_of(args):
    """Returns the rows by name. The name has a checksum of all options, so that other options have other files."""
    keys = ["model", "schedule", "samples", "effort", "seed", "data", "test"]
    rows = [dict(zip(keys, values)) for values in itertools.product(*(getattr(args, key) for key in keys))]
    name = "{model}-n{samples}-{schedule}-{effort}-s{seed}-".format
    return {name(**row) + digest(row, args.options, glimpse.__version__): row for row in rows}


def digest(*values):
    return f"{zlib.crc32(json.dumps(values, sort_keys=True).encode()):08x}"


def compute(name, row, options, out, threads):
    """Trains and evaluates a row on a worker, unless that is done. All results are files, written whole."""
    with open(out / f"locks/{name}", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # a worker that Dask gave up may still run
        return compute_alone(name, row, options, out, threads)


def compute_alone(name, row, options, out, threads):
    result, recipe_path = out / f"rows/{name}.json", out / f"recipes/{name}.recipe"
    if result.exists():
        return json.loads(result.read_text())
    if recipe_path.exists():
        recipe = glimpse.Recipe.load(recipe_path)
    else:
        given = {key: row[key] for key in ["samples", "schedule", "effort", "seed"]}
        saved = {"checkpoint": out / f"checkpoints/{name}", "resume": True}
        recipe = glimpse.train(row["model"], row["data"], progress=False, threads=threads, **saved, **given, **options)
        recipe.save(recipe_path, overwrite=True)
    report = glimpse.evaluate(recipe, row["test"], threads=threads)
    values = {**row, "checksum": recipe.checksum, **{key: report[key] for key in RESULTS[1:]}}
    write(result, json.dumps(values))
    return values


def write(path, text):
    part = path.with_name(f"{path.name}.{uuid.uuid4()}")
    part.write_text(text)
    os.replace(part, path)


def main(arguments=None):
    args = parse(arguments)
    out, rows = args.out.resolve(), rows_of(args)
    for folder in ["rows", "recipes", "checkpoints", "locks"]:
        (out / folder).mkdir(parents=True, exist_ok=True)
    workers = {"n_workers": max(1, os.cpu_count() // max(1, args.threads)), "threads_per_worker": 1}
    finished, failed = {}, 0
    with Client(args.scheduler) if args.scheduler else Client(**workers) as client:
        print(f"{len(rows)} rows; dashboard: {client.dashboard_link}", flush=True)
        fixed = (args.options, out, args.threads)
        # Other studies on the same cluster have other keys.
        names = {f"{name}-{digest(str(out))}": name for name in rows}
        futures = [client.submit(compute, name, rows[name], *fixed, key=key) for key, name in names.items()]
        for count, future in enumerate(as_completed(futures), 1):
            name, line = names[future.key], f"{count}/{len(rows)} {names[future.key]}"
            if future.status == "finished":
                finished[name] = future.result()
                print(f"{line}: loss {finished[name]['loss']:.4f}", flush=True)
            else:
                failed += 1
                print(f"{line} failed: {future.exception()}", file=sys.stderr, flush=True)
    with open(out / "study.csv.part", "w", newline="") as file:
        table = csv.DictWriter(file, [*next(iter(rows.values())), *RESULTS])
        table.writeheader()
        table.writerows(finished[name] for name in rows if name in finished)
    os.replace(out / "study.csv.part", out / "study.csv")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
