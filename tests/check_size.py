"""Counts the lines of Rust that are neither blank nor comments, and fails if there are more than the ceilings.

    python3 tests/check_size.py

Ceilings only fall: a change that makes the code smaller lowers them to the printed counts. Tests are files below tests/ or
fuzz/, files named tests.rs, and inline modules after #[cfg(test)].
"""
import re, subprocess, sys
from pathlib import Path

CEILINGS = {"code": 44_623, "tests": 24_865}

ROOT = Path(__file__).resolve().parents[1]
TEST_FILE = re.compile(r"(^|/)(tests|fuzz)/|(^|/)tests\.rs$")
TEST_ATTRIBUTE = re.compile(r"#\[cfg\((all\()?test")
LITERAL_OR_COMMENT = re.compile(r"""'(\\.|[^'\\])'|"(\\.|[^"\\])*"|//.*""")


def count(path, counts):
    """Adds the lines of one file."""
    is_test_file = bool(TEST_FILE.search(path))
    follows_attribute = False
    open_braces = None  # of the item after #[cfg(test)]
    for line in (ROOT / path).read_text().splitlines():
        line = line.strip()
        if not line or line.startswith("//"):
            continue
        if open_braces is None and TEST_ATTRIBUTE.match(line):
            follows_attribute = True
        is_test = is_test_file or follows_attribute or open_braces is not None
        counts["tests" if is_test else "code"] += 1
        if follows_attribute and not line.startswith("#"):
            follows_attribute, open_braces = False, 0
        if open_braces is not None:
            line = LITERAL_OR_COMMENT.sub("", line)
            open_braces += line.count("{") - line.count("}")
            if open_braces <= 0:
                open_braces = None


def main():
    counts = dict.fromkeys(CEILINGS, 0)
    files = subprocess.run(["git", "ls-files", "*.rs"], cwd=ROOT, check=True, text=True, stdout=subprocess.PIPE)
    for path in files.stdout.splitlines():
        if (ROOT / path).exists():
            count(path, counts)
    above = []
    for name, ceiling in CEILINGS.items():
        print(f"{counts[name]:,} lines of {name}, at most {ceiling:,}")
        if counts[name] > ceiling:
            above.append(f"{name}: {counts[name] - ceiling:,} lines above the ceiling in tests/check_size.py: remove code")
    sys.exit("\n".join(above) or None)


if __name__ == "__main__":
    main()
