"""Every package that is compiled in may be passed on under MIT or Apache-2.0 and what goes with them.

    python3 tests/licenses.py [MANIFEST...]

Reads what cargo knows of each manifest's packages (the workspace's, if none is named); no network is asked.
"""
import json, re, subprocess, sys

# What may be linked into a program whose own license is MIT or Apache-2.0.
TAKEN = {
    "0BSD", "Apache-2.0", "Apache-2.0 WITH LLVM-exception", "BSD-2-Clause", "BSD-3-Clause", "BSL-1.0", "CC0-1.0", "ISC",
    "MIT", "Unicode-3.0", "Unlicense", "Zlib",
    # Of fonts alone, which pictures are labeled in.
    "OFL-1.1", "Ubuntu-font-1.0",
}


def is_taken(expression):
    """True if an SPDX expression has a way to be fulfilled by what is taken."""
    # The old way to write OR.
    expression = re.sub(r"\s*/\s*", " OR ", expression)
    words = re.split(r"(\bAND\b|\bOR\b|[()])", expression)
    words = [word.strip() for word in words if word.strip()]
    operators = {"AND": "and", "OR": "or", "(": "(", ")": ")"}
    return eval(" ".join(operators.get(word) or str(word in TAKEN) for word in words))


def main():
    assert is_taken("(MIT OR GPL-2.0) AND Zlib") and is_taken("MIT/GPL-2.0") and not is_taken("MIT AND GPL-2.0")
    refused, seen = [], set()
    for manifest in sys.argv[1:] or ["Cargo.toml"]:
        command = ["cargo", "metadata", "--format-version", "1", "--locked", "--manifest-path", manifest]
        for package in json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)["packages"]:
            name = f"{package['name']} {package['version']}"
            if name in seen or package["source"] is None:
                continue
            seen.add(name)
            if not is_taken(package["license"] or "none"):
                refused.append(f"{name}: {package['license'] or 'says no license'}")
    print(f"{len(seen)} packages of others', {len(refused)} under licenses that are not taken")
    sys.exit("\n".join(refused) or None)


if __name__ == "__main__":
    main()
