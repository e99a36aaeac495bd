"""Compares the public items of a crate, as rendered by rustdoc, with a committed list.

    python3 tests/check_api.py target/doc/glimpse_core core/docs/api.txt             # fails on a difference
    python3 tests/check_api.py target/doc/glimpse_core core/docs/api.txt --update    # writes the list
"""

import difflib
import html
import re
import sys
from pathlib import Path

DECLARATION = re.compile(r'<pre class="rust item-decl"><code>(.*?)</code></pre>', re.S)
METHOD = re.compile(r'<h4 class="code-header">(.*?)</h4>', re.S)
IMPLEMENTATION = re.compile(r'<h3 class="code-header">(impl.*?)</h3>', re.S)
# Implementations that are derived, or the same for every type.
REST = re.compile(r'id="(?:synthetic|blanket)-implementations"')


def plain(code):
    """Returns the text of some HTML on one line."""
    code = re.sub(r'<span class="comment">.*?</span>', "", code)
    text = html.unescape(re.sub(r"<[^>]*>", "", code)).replace("where\n", " where ")
    return re.sub(r"\s+", " ", text).strip()


def items(folder):
    """Yields a line for each public item, method and implementation."""
    for page in sorted(folder.rglob("*.html")):
        text = page.read_text()
        declared = DECLARATION.search(text)
        if not declared:
            continue
        path = "::".join([*page.relative_to(folder.parent).parts[:-1], page.name.split(".")[1]])
        yield f"{path}: {plain(declared[1])}"
        own, _, traits = REST.split(text)[0].partition('id="trait-implementations"')
        for header in METHOD.findall(own) + IMPLEMENTATION.findall(traits):
            if "StructuralPartialEq" not in header:
                yield f"{path}: {plain(header)}"


def main():
    folder, file = Path(sys.argv[1]), Path(sys.argv[2])
    documented = [line + "\n" for line in items(folder)]
    if not documented:
        sys.exit(f"{folder} has no public item: build the documentation first")
    if "--update" in sys.argv[3:]:
        file.write_text("".join(documented))
        return
    listed = file.read_text().splitlines(keepends=True)
    difference = list(difflib.unified_diff(listed, documented, str(file), "the documentation", n=0))
    if difference:
        sys.stdout.writelines(difference)
        sys.exit(f"the public API differs from {file}: if this is intended, run the script with --update, "
                 "and describe breaking changes in CHANGELOG.md")
    print(f"{len(documented)} public items match {file}")


main()
