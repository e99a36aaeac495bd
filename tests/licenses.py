"""Checks that the license of every dependency is compatible with MIT or Apache-2.0.

    python3 tests/licenses.py [MANIFEST...]

The licenses are those in the output of `cargo metadata` for each manifest (default: Cargo.toml). It needs no network.
"""
import json, re, subprocess, sys

# Licenses of code that may be linked into a program under MIT or Apache-2.0.
ACCEPTED = {
    "0BSD", "Apache-2.0", "Apache-2.0 WITH LLVM-exception", "BSD-2-Clause", "BSD-3-Clause", "BSL-1.0", "CC0-1.0", "ISC",
    "MIT", "Unicode-3.0", "Unlicense", "Zlib",
    # For the fonts of labels in pictures.
    "OFL-1.1", "Ubuntu-font-1.0",
}


def is_accepted(expression):
    """Returns true if accepted licenses can satisfy an SPDX expression."""
    # "/" is the old notation of OR.
    expression = re.sub(r"\s*/\s*", " OR ", expression)
    words = re.split(r"(\bAND\b|\bOR\b|[()])", expression)
    words = [word.strip() for word in words if word.strip()]
    operators = {"AND": "and", "OR": "or", "(": "(", ")": ")"}
    return eval(" ".join(operators.get(word) or str(word in ACCEPTED) for word in words))


def main():
    assert is_accepted("(MIT OR GPL-2.0) AND Zlib") and is_accepted("MIT/GPL-2.0")
    assert not is_accepted("MIT AND GPL-2.0")
    rejected, seen = [], set()
    for manifest in sys.argv[1:] or ["Cargo.toml"]:
        command = ["cargo", "metadata", "--format-version", "1", "--locked", "--manifest-path", manifest]
        for package in json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)["packages"]:
            name = f"{package['name']} {package['version']}"
            if name in seen or package["source"] is None:
                continue
            seen.add(name)
            if not is_accepted(package["license"] or "none"):
                rejected.append(f"{name}: {package['license'] or 'no license'}")
    print(f"{len(seen)} dependencies, {len(rejected)} with a license that is not accepted")
    sys.exit("\n".join(rejected) or None)


if __name__ == "__main__":
    main()
