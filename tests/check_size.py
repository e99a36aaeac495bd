"""Counts the lines of Rust that are neither blank nor comments, and the words of documents. It fails if there are more than
the ceilings.

    python3 tests/check_size.py

Ceilings only fall: a change that makes the code smaller lowers them to the printed counts. Tests are files below tests/ or
fuzz/, files named tests.rs, and inline modules after #[cfg(test)].
"""
import re, subprocess, sys
from pathlib import Path

CEILINGS = {"lines of code": 46_039, "lines of tests": 21_915, "words of documents": 19_891}

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
        counts["lines of tests" if is_test else "lines of code"] += 1
        if follows_attribute and not line.startswith("#"):
            follows_attribute, open_braces = False, 0
        if open_braces is not None:
            line = LITERAL_OR_COMMENT.sub("", line)
            open_braces += line.count("{") - line.count("}")
            if open_braces <= 0:
                open_braces = None


def existing_files(pattern):
    """Returns the files of the repository with names like a pattern."""
    listed = subprocess.run(["git", "ls-files", pattern], cwd=ROOT, check=True, text=True, stdout=subprocess.PIPE)
    return [path for path in listed.stdout.splitlines() if (ROOT / path).exists()]


def main():
    counts = dict.fromkeys(CEILINGS, 0)
    for path in existing_files("*.rs"):
        count(path, counts)
    for path in existing_files("*.md"):
        counts["words of documents"] += len((ROOT / path).read_text().split())
    above = []
    for name, ceiling in CEILINGS.items():
        print(f"{counts[name]:,} {name}, at most {ceiling:,}")
        if counts[name] > ceiling:
            above.append(f"{counts[name] - ceiling:,} {name} above the ceiling in tests/check_size.py: remove some")
    sys.exit("\n".join(above) or None)


if __name__ == "__main__":
    main()
