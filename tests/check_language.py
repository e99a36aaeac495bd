#!/usr/bin/env python3
"""Counts sentences that break the language rules of `trainer/docs/contributing.md`.

    python3 tests/check_language.py [--list]

Fails if a count exceeds its ceiling below. Ceilings only ever fall: lower them with each clean-up.
`--list` prints every finding as FILE:LINE: TEXT. Rust, C, Python, shell, Markdown and notebooks are read:
comments and string literals of code (help texts and error messages are among them), and the text of documents."""
import io, json, re, subprocess, sys, tokenize

# Sentences that open with a question word and are not questions.
OPENER = re.compile(r"(What|How|Whether|Where|Which|Who|Why)\b[^?]*$")
OPENERS_CEILING = 900
BANNED = re.compile(
    r"\b(told|tells|so many|comes? along|is no(?! longer)|are no|besides|anew|whoever|in the mean)\b", re.I)
BANNED_CEILING = 380

# In Rust and C: a comment line, or a string literal.
CODE = re.compile(r'//[/!]?(?P<line>[^\n]*)|/\*(?P<block>.*?)\*/|"(?P<string>(?:\\.|[^"\\])*)"|' r"'(?:\\.|[^'\\])'", re.S)


def of_code(text):
    """Comments and strings of Rust and C as (line number, text)."""
    for match in CODE.finditer(text):
        number = text.count("\n", 0, match.start()) + 1
        if match["line"] is not None:
            yield number, match["line"]
        elif match["block"] or match["string"]:
            # Never joined with what stands on the lines around it.
            found = re.sub(r"\\\n\s*|\n\s*\*?", " ", match["block"] or match["string"])
            yield from ((number, ""), (number, found), (number, ""))


def of_python(text):
    """Comments and strings of Python."""
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string.lstrip("#! ")
        elif token.type == tokenize.STRING:
            for offset, line in enumerate(token.string.strip("rbfu\"'").splitlines()):
                yield token.start[0] + offset, line


def of_shell(text):
    """Comments of a shell script."""
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith("#"):
            yield number, line.lstrip("#! ")


def of_markdown(text):
    """Lines of a document outside of code blocks, without list marks and table bars."""
    fenced = False
    for number, line in enumerate(text.splitlines(), 1):
        fenced ^= line.lstrip().startswith("```")
        if not fenced:
            yield number, re.sub(r"^\s*(?:[-*>#|]+|\d+\.)\s*|`[^`]*`", "", line)


def of_notebook(text):
    """Text cells of a notebook; each line counts as line 1."""
    for cell in json.loads(text)["cells"]:
        if cell["cell_type"] == "markdown":
            yield from ((1, line) for _, line in of_markdown("".join(cell["source"])))


READERS = {"rs": of_code, "h": of_code, "c": of_code, "py": of_python, "pyi": of_python, "sh": of_shell,
           "md": of_markdown, "ipynb": of_notebook, "run": of_shell, "release": of_shell}


def sentences(pieces):
    """Joins lines that follow each other and splits them into (line number, sentence)."""
    first, last, text = 1, None, ""
    for number, piece in [*pieces, (None, "")]:
        follows = piece.strip() and number in (last, last and last + 1)
        if not follows:
            for sentence in re.split(r"(?<=[.!?:])\s+", text):
                yield first, sentence.strip()
            first, text = number, ""
        text, last = f"{text} {piece.strip()}".strip(), number


def findings(name, text):
    """Openers and banned words of a file, each as (line number, sentence)."""
    kind = name.rsplit("/", 1)[-1].rsplit(".", 1)[-1]
    found = list(sentences(READERS[kind](text)))
    openers = [each for each in found if OPENER.match(each[1])]
    return openers, [each for each in found for _ in BANNED.findall(each[1])]


def self_test():
    openers, banned = findings("a.rs", '/// What it does.\n/// It is no longer so.\nlet x = "none besides";\n// Why?\n')
    assert [line for line, _ in openers] == [1] and [line for line, _ in banned] == [3], (openers, banned)
    openers, banned = findings("a.md", "# How to train\n\n```sh\n# What?\n```\n- it is told\n  anew\n")
    assert len(openers) == 1 and len(banned) == 2, (openers, banned)


def main():
    self_test()
    files = subprocess.run(["git", "ls-files"], check=True, capture_output=True, text=True).stdout.split()
    files = [name for name in files if name.rsplit("/", 1)[-1].rsplit(".", 1)[-1] in READERS
             and name != "tests/check_language.py"]
    counts = {"openers": 0, "banned words": 0}
    for name in files:
        for kind, found in zip(counts, findings(name, open(name, encoding="utf-8").read())):
            counts[kind] += len(found)
            if "--list" in sys.argv:
                print(*(f"{name}:{line}: {sentence}" for line, sentence in found), sep="\n", end="\n" if found else "")
    ceilings = {"openers": OPENERS_CEILING, "banned words": BANNED_CEILING}
    print(", ".join(f"{kind}: {count} (at most {ceilings[kind]})" for kind, count in counts.items()))
    if any(counts[kind] > ceilings[kind] for kind in counts):
        sys.exit("too many: `python3 tests/check_language.py --list` shows them; rewrite what you added or touched")


if __name__ == "__main__":
    main()
