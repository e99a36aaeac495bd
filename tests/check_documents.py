"""Checks the documents: links lead somewhere, and tables of figures name a valid command that prints them.

    python3 tests/check_documents.py TRAINER

A command of the trainer is valid if the program accepts it with `--help` at the end. A command of cargo is valid if the
package has the example or the test, and its features. `run_documents.py` runs the commands in blocks.
"""
import json, re, shlex, subprocess, sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
MARKED = re.compile(r"^<!-- printed by: ([^\n]*) -->\n(.+?)^<!-- end of what is printed -->$", re.M | re.S)
# A document with a table of numbers from several commands, which its text names.
OF_SEVERAL_COMMANDS = "core/docs/basis.md"


def anchor(heading):
    """Returns the anchor that GitHub gives to a heading."""
    return re.sub(r"[^\w -]", "", heading.lstrip("#").strip().lower()).replace(" ", "-")


def link_errors(path, text):
    prose = "".join(text.split("```")[::2])
    for target in re.findall(r"\]\(([^)]*)\)", prose):
        name, _, heading = target.partition("#")
        file = path.parent / name if name else path
        if target.startswith(("http://", "https://")):
            continue
        if not file.exists():
            yield f"{name} does not exist"
        elif heading and heading not in map(anchor, re.findall(r"^#+ .*", file.read_text(), re.M)):
            yield f"{name} has no heading {heading}"


def is_row_of_figures(line):
    cells = [cell for cell in line.split("|") if re.search(r"\d", cell) and not re.search(r"[^\W\d_]", cell)]
    return line.startswith("|") and len(cells) >= 3


def words(command):
    """Returns the words of a command, or of the first one of several, without redirections."""
    command = re.split(r" #|&&|\||;", command)[0]
    return shlex.split(re.sub(r"\d?>>?\s*\S+", "", command))


def command_errors(trainer, command):
    first, *rest = words(command)
    if first == "trainer":
        result = subprocess.run([trainer, *rest, "--help"], capture_output=True, text=True, cwd=ROOT)
        return [] if result.returncode == 0 else [f"{command}: {result.stderr}"]
    option = lambda name: rest[rest.index(name) + 1] if name in rest else None
    kind = "example" if "--example" in rest else "test"
    manifest = option("--manifest-path") or "Cargo.toml"
    metadata = subprocess.run(["cargo", "metadata", "--no-deps", "--offline", "--format-version=1", "--manifest-path",
                               manifest], cwd=ROOT, check=True, capture_output=True, text=True)
    for package in json.loads(metadata.stdout)["packages"]:
        names = [target["name"] for target in package["targets"] if target["kind"] == [kind]]
        has_features = option("--features") in (None, *package["features"])
        if first == "cargo" and package["name"] == option("-p") and option(f"--{kind}") in names and has_features:
            return []
    return [f"cargo has no such {kind}: {command}"]


def cycles_errors():
    """Compares the cycles of bundled recipes with the table of costs."""
    rows = re.findall(r"^\| thumbv7em-none-eabihf \| (\S+)-(completed|masked) \|(?:[^|]*\|){3} ([\d,]+) \|",
                      (ROOT / "core/docs/costs.md").read_text(), re.M)
    suffixes = {"completed": "n8", "masked": "n16-masked"}
    expected = {f"{model}-{suffixes[kind]},{cycles.replace(',', '')}" for model, kind, cycles in rows}
    found = set((ROOT / "trainer/recipes/cycles.csv").read_text().splitlines()[1:])
    return [f"trainer/recipes/cycles.csv and core/docs/costs.md differ: {row}" for row in expected ^ found]


def main():
    trainer = Path(sys.argv[1]).resolve()
    listed = subprocess.run(["git", "ls-files", "*.md"], cwd=ROOT, check=True, capture_output=True, text=True)
    errors, links = cycles_errors(), 0
    for name in listed.stdout.splitlines():
        path = ROOT / name
        text = path.read_text()
        links += text.count("](")
        found = list(link_errors(path, text))
        marked = [command for command, _ in MARKED.findall(text)]
        if len(marked) != text.count("<!-- printed by") and not name.startswith("."):
            found.append("a marker is not closed, or has no output")
        if name.startswith(("README", "core/docs", "trainer/docs")) and name != OF_SEVERAL_COMMANDS:
            rows = filter(is_row_of_figures, MARKED.sub("", text).splitlines())
            found += [f"no marker names the command that prints this row: {row}" for row in rows]
        if not name.startswith("."):
            found += [error for command in marked for error in command_errors(trainer, command)]
        errors += [f"{name}: {error}" for error in found]
    if len((ROOT / "README.md").read_text().splitlines()) > 120:
        errors.append("README.md has more than 120 lines: move some of it to a document")
    if links < 100:
        errors.append(f"only {links} links were found")
    sys.exit("\n".join(errors) or None)


if __name__ == "__main__":
    main()
