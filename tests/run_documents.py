"""Runs the documents: each block of commands or code, as pasted, in the order in which a document has them.

    PYTHON tests/run_documents.py TRAINER [WORD]

PYTHON has the module `glimpse_brdf` and Mitsuba. WORD selects documents whose names contain it. Each document has its own
folder, with the files that its reader has. Blocks of a document run until one fails; then the next document begins.

- `sh`: with `trainer` on the path. `cargo run --release --bin trainer --` is the same program
- `python`: a script
- `csv`: the contents of the first CSV file of the next block
- `c`: compiled with core's header
- `toml`: a part of a package's manifest, which `cargo check` accepts without a warning
- `rust`: a source file includes the document, so that `cargo test` runs the block
- `text`: a picture; nothing to run

The comment `<!-- not run: REASON -->` excludes the block in the next line, or below a heading all blocks of its section.
"""
import csv, os, re, shlex, subprocess, sys, tempfile, time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

# Files and folders that a reader has, and the commands that make them here.
FIXTURES = {
    "MERL": "mkdir MERL; for i in 1 2 3 4 5 6; do trainer convert procedural:1:$i MERL/$i.binary; done",
    "MERL-test": "mkdir MERL-test; for i in 7 8; do trainer convert procedural:1:$i MERL-test/$i.binary; done",
    "NETWORKS": "mkdir NETWORKS; for i in 1 2 3 4 5; do touch NETWORKS/$i-material_fc1.npy; done",
    "aurora_white_rgb.bsdf": "trainer convert procedural:1:9 aurora_white_rgb.bsdf",
    "acrylic_felt_green_rgb.bsdf": "trainer convert procedural:1:11 acrylic_felt_green_rgb.bsdf",
    "gold.binary": "trainer convert procedural:1:77 gold.binary",
    "n8.recipe": "trainer train --model linear --samples 8 --data procedural:20 --out n8.recipe",
    **{f"gold-n{n}": f"""
        trainer plan neural-n{n} --blank sheet.csv
        trainer query procedural:1:77 --angles sheet.csv --out readings.csv
        trainer fit neural-n{n} --measurements readings.csv --out gold-n{n}""" for n in (8, 16)},
    "line45.csv": r"printf 'theta_i,theta_o\n45,0\n45,20\n45,60\n' > line45.csv",
    "car.csv": r"printf 'theta_i,theta_o,400,500,600,700\n45,-30,5,6,30,35\n45,20,7,8,33,37\n' > car.csv",
    # The checkout, with the paths that documents name.
    "tests/run": "mkdir tests; printf '#!/bin/sh\n' > tests/run; chmod +x tests/run # which runs this script",
    "embedded-demo": "mkdir embedded-demo",
    "glimpse": f"ln -s {shlex.quote(str(ROOT))} glimpse",
}
READER_HAS = {
    "README.md": ["MERL", "MERL-test", "tests/run"],
    ".github/CONTRIBUTING.md": ["NETWORKS"],
    "core/README.md": ["glimpse"],
    "core/docs/basis.md": ["n8.recipe", "MERL-test"],
    "embedded-demo/README.md": ["MERL", "embedded-demo"],
    "trainer/docs/commands.md": ["gold.binary", "gold-n8", "gold-n16", "MERL", "MERL-test", "n8.recipe", "line45.csv",
                                 "car.csv"],
    "trainer/docs/photographs.md": ["acrylic_felt_green_rgb.bsdf"],
    "trainer/docs/tutorial.md": ["MERL", "aurora_white_rgb.bsdf"],
}
# Trainings are short. A person fills in empty cells of a sheet with the readings of a red paint.
EFFORT = ["--effort", "brief"]
PYTHON_EFFORT = "import glimpse_brdf as _g; _t = _g.train; _g.train = lambda *a, **k: _t(*a, **{**k, 'effort': 'brief'})\n"
PAINT = {"r": 0.13, "g": 0.03, "b": 0.026}  # BRDF, sr⁻¹
PERCENT = {"r": 41.2, "g": 9.2, "b": 8.2}
GLOSS_UNITS = {"gloss-20": 5, "gloss-60": 28.7, "gloss-85": 60}

RUN_TRAINER = ["cargo", "run", "--release", "--bin", "trainer", "--"]
# Programs that would change the machine.
REFUSED = ["cargo", "pip", "rustup", "sudo"]

CHECK = "cargo check --offline --color never 2>&1 | tee output && ! grep -qE '^(warning|error)' output"
MANIFEST = '[package]\nname = "reader"\nversion = "0.1.0"\nedition = "2024"\n\n[lib]\npath = "lib.rs"\n\n'
MARKER = re.compile(r"<!-- not run: (.+) -->")


def fill_in(sheet):
    """Fills in the empty cells of a sheet that `plan` or `next` wrote."""
    with open(sheet, newline="") as file:
        rows = list(csv.DictReader(file))
    is_complete = True
    for row in rows if rows and {"r", "g", "b"} <= rows[0].keys() else []:
        instrument = row.get("instrument")
        readings = PERCENT if instrument else PAINT
        if instrument in GLOSS_UNITS:
            readings = {"value": GLOSS_UNITS[instrument]}
        if not any(row.get(name) for name in readings):
            row.update(readings)
            is_complete = False
    if is_complete:
        return
    with open(sheet, "w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def be_program(trainer, name, arguments):
    """Replaces this process by the trainer, if `name` (`trainer` or one of REFUSED) and its arguments start it."""
    if name != "trainer":
        if [name, *arguments[:5]] != RUN_TRAINER:
            sys.exit(f"of {name}, only `{shlex.join(RUN_TRAINER)}` can run here: mark the block as not run")
        arguments = arguments[5:]
    if arguments[:1] == ["train"] and "--effort" not in arguments:
        arguments += EFFORT
    if "--measurements" in arguments[:-1]:
        fill_in(arguments[arguments.index("--measurements") + 1])
    os.execv(trainer, ["trainer", *arguments])


def blocks(text):
    """Yields line number, language, contents and marker (or None) of each block."""
    block, contents, marker, section, before = None, [], None, None, ""
    for number, line in enumerate(text.splitlines(), 1):
        bare = line.strip()
        if block is not None and bare == "```":
            yield *block, "\n".join(contents) + "\n", marker or section and section[1]
            block, marker, before = None, None, ""
        elif block is not None:
            contents.append(line)
        elif bare.startswith("```"):
            block, contents = (number, bare.strip("`")), []
        else:
            assert marker is None, f"line {number}: a block or a heading has to stand next to the marker above"
            level = len(bare) - len(bare.lstrip("#"))
            if section and 0 < level <= section[0]:
                section = None
            found = MARKER.fullmatch(bare)
            if found and before.startswith("#"):
                section = len(before) - len(before.lstrip("#")), found[1]
            elif found:
                marker = found[1]
            before = bare or before
    assert block is None, "a block is not closed"


def including_sources():
    """Returns the documents whose programs `cargo test` runs."""
    listed = subprocess.run(["git", "ls-files", "*.rs"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    for source in map(ROOT.joinpath, listed.split()):
        for name in re.findall(r'doc = include_str!\("(.*?\.md)"\)', source.read_text() if source.exists() else ""):
            yield (source.parent / name).resolve()


class Runner:
    def __init__(self, trainer, scratch):
        self.scratch, self.tested, self.made, self.count = scratch, set(including_sources()), scratch / "fixtures", 0
        programs = scratch / "bin"
        programs.mkdir()
        self.made.mkdir()
        for name in ("trainer", *REFUSED):
            command = shlex.join([sys.executable, str(Path(__file__).resolve()), str(trainer), "--as", name])
            (programs / name).write_text(f'#!/bin/sh\nexec {command} "$@"\n')
            (programs / name).chmod(0o755)
        self.environment = {**os.environ, "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}"}

    def run(self, command, folder, environment=None):
        """Runs a command and returns None, or its output if it fails."""
        done = subprocess.run(command, cwd=folder, env=environment, text=True, stdin=subprocess.DEVNULL, timeout=600,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        return done.stdout or f"exit code {done.returncode}" if done.returncode else None

    def shell(self, script, folder):
        return self.run(["bash", "-euo", "pipefail", "-c", script], folder, self.environment)

    def give(self, name, folder):
        """Gives the document's reader a file. It is made once, in an own folder, with what belongs to it."""
        own = self.made / name.replace("/", "-")
        if not own.exists():
            own.mkdir()
            error = self.shell(FIXTURES[name], own)
            assert error is None and (own / name).exists(), f"the file {name} was not made: {error}"
        for path in own.glob(f"{Path(name).parts[0].partition('.')[0]}*"):
            (folder / path.name).symlink_to(path)

    def run_block(self, document, language, contents, following, folder):
        """Runs a block and returns None, or the reason why it fails."""
        if language == "sh":
            return self.shell(contents, folder)
        if language == "python":
            return self.run([sys.executable, "-c", PYTHON_EFFORT + contents], folder, self.environment)
        if language == "csv":
            name = re.search(r"\S+\.csv\b", following)
            if name is None:
                return "the next block has no CSV file with these contents"
            (folder / name[0]).write_text(contents)
            return None
        if language == "c":
            (folder / "block.c").write_text(contents)
            options = ["-std=c11", "-Wall", "-Wextra", "-Werror", "-I", str(ROOT / "core/capi/include")]
            return self.run(["cc", *options, "-c", "block.c", "-o", "block.o"], folder)
        if language == "toml":
            (folder / "Cargo.toml").write_text(MANIFEST + contents)
            (folder / "lib.rs").touch()
            (folder / "Cargo.lock").write_bytes((ROOT / "Cargo.lock").read_bytes())
            return self.run(["bash", "-c", CHECK], folder)
        if language == "rust":
            return None if (ROOT / document).resolve() in self.tested else "no source file includes this document"
        return None if language == "text" else f"a block in `{language}` cannot run: mark it as not run"

    def run_document(self, document):
        """Runs a document's blocks until one fails. Returns its line and the reason, or None."""
        folder = self.scratch / document.replace("/", "-")
        folder.mkdir()
        found = list(blocks((ROOT / document).read_text()))
        if any(marker is None for *_, marker in found):
            for name in READER_HAS.get(document, []):
                self.give(name, folder)
        followings = [contents for _, _, contents, _ in found[1:]] + [""]
        for (line, language, contents, marker), following in zip(found, followings):
            if marker is not None:
                print(f"{document}:{line}: not run: {marker}")
                continue
            start = time.monotonic()
            error = self.run_block(document, language, contents, following, folder)
            self.count += 1
            if error is not None:
                return f"{document}:{line}: the block fails:\n{contents}\n{error}"
            print(f"{document}:{line}: {language}, {time.monotonic() - start:.1f} s", flush=True)


def main():
    trainer, *arguments = sys.argv[1:]
    trainer = Path(trainer).resolve()
    if arguments[:1] == ["--as"]:
        be_program(trainer, arguments[1], arguments[2:])
    word = "".join(arguments)
    listed = subprocess.run(["git", "ls-files", "*.md"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    failures = [f"READER_HAS: no such document: {name}" for name in READER_HAS.keys() - set(listed.split())]
    with tempfile.TemporaryDirectory() as scratch:
        runner = Runner(trainer, Path(scratch))
        for document in listed.split():
            if word in document:
                try:
                    failures.append(runner.run_document(document))
                except (AssertionError, subprocess.TimeoutExpired) as error:
                    failures.append(f"{document}: {error}")
    failures = [failure for failure in failures if failure]
    print(f"{runner.count} blocks run, {len(failures)} documents fail")
    sys.exit("\n\n".join(failures) or None)


if __name__ == "__main__":
    main()
