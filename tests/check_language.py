#!/usr/bin/env python3
"""Counts sentences that break the language rules of `.github/CONTRIBUTING.md`.

    python3 tests/check_language.py [--list]

The check fails if a count exceeds its ceiling below. Lower the ceilings with each clean-up, and never raise them.
`--list` prints every finding as FILE:LINE: TEXT. The script reads Rust, C, Python, shell, Markdown and notebooks. In
code it checks comments and string literals, which include help texts and error messages.

It also fails if two public types of core and trainer have the same name, or if a type has a word of the glossary in its
name outside of this word's home."""
import io, json, re, subprocess, sys, tokenize

# Sentences that start with a question word but are not questions.
OPENER = re.compile(r"(What|How|Whether|Where|Which|Who|Why)\b[^?]*$")
OPENERS_CEILING = 3
BANNED = re.compile(
    r"\b(told|tells|so many|comes? along|is no(?! longer)|are no|besides|anew|whoever|in the mean)\b", re.I)
BANNED_CEILING = 1

# Words of the glossary, and the folders or files that define the types with this word in their names.
HOMES = {
    "Completion": r"core/src/fit/|kernels/src/completion",
    "Fold": r"training/src/(prior|paper)/",
    "Method": r"evaluation/src/|commands/",
    "Plan": r"fitting/src/route/|commands/plan|python/src/plan",
    "Posterior": r"fitting/src/linear/",
    "Prior": r"(fitting|training)/src/(linear|prior)/",
    "Schedule": r"fitting/src/recipe/",
}
# Also the sections of recipes, which core's macro `section` defines.
TYPE = re.compile(r"^(?P<public>pub |    (?=\w+<'a> = \d+, \"))?(?:pub\(\w+\) )?"
                  r"(?:struct |enum |union |trait |type |(?<=^    ))(?P<name>\w+)", re.M)

# A comment line, a block comment, a string literal or a character literal of Rust and C.
CODE = re.compile(r'//[/!]?(?P<line>[^\n]*)|/\*(?P<block>.*?)\*/|"(?P<string>(?:\\.|[^"\\])*)"|' r"'(?:\\.|[^'\\])'", re.S)


def code_pieces(text):
    """Yields comments and strings of Rust and C as (line number, text)."""
    for match in CODE.finditer(text):
        number = text.count("\n", 0, match.start()) + 1
        if match["line"] is not None:
            yield number, match["line"]
        elif match["block"] or match["string"]:
            # The empty pieces prevent joining with adjacent lines.
            joined = re.sub(r"\\\n\s*|\n\s*\*?", " ", match["block"] or match["string"])
            yield from ((number, ""), (number, joined), (number, ""))


def python_pieces(text):
    """Yields comments and strings of Python."""
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string.lstrip("#! ")
        elif token.type == tokenize.STRING:
            for offset, line in enumerate(token.string.strip("rbfu\"'").splitlines()):
                yield token.start[0] + offset, line


def shell_pieces(text):
    """Yields comments of a shell script."""
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith("#"):
            yield number, line.lstrip("#! ")


def markdown_pieces(text):
    """Yields lines of a document outside code blocks, without list markers, leading table bars and inline code."""
    fenced = False
    for number, line in enumerate(text.splitlines(), 1):
        fenced ^= line.lstrip().startswith("```")
        if not fenced:
            yield number, re.sub(r"^\s*(?:[-*>#|]+|\d+\.)\s*|`[^`]*`", "", line)


def notebook_pieces(text):
    """Yields lines of a notebook's text cells, all with line number 1."""
    for cell in json.loads(text)["cells"]:
        if cell["cell_type"] == "markdown":
            yield from ((1, line) for _, line in markdown_pieces("".join(cell["source"])))


# By the ending of a file's name, or the whole name if it has none.
READERS = {"rs": code_pieces, "h": code_pieces, "c": code_pieces, "py": python_pieces, "pyi": python_pieces,
           "sh": shell_pieces, "run": shell_pieces, "release": shell_pieces, "md": markdown_pieces,
           "ipynb": notebook_pieces}


def sentences(pieces):
    """Joins consecutive lines, splits them into sentences, and yields each as (line number, sentence)."""
    first, last, text = 1, None, ""
    for number, piece in [*pieces, (None, "")]:
        continues = piece.strip() and number in (last, last and last + 1)
        if not continues:
            for sentence in re.split(r"(?<=[.!?:])\s+", text):
                yield first, sentence.strip()
            first, text = number, ""
        text, last = f"{text} {piece.strip()}".strip(), number


def ending(name):
    return name.rsplit("/", 1)[-1].rsplit(".", 1)[-1]


def findings(name, text):
    """Returns the openers and the banned words of a file, each as (line number, sentence)."""
    numbered = list(sentences(READERS[ending(name)](text)))
    openers = [(line, sentence) for line, sentence in numbered if OPENER.match(sentence)]
    return openers, [(line, sentence) for line, sentence in numbered for _ in BANNED.findall(sentence)]


def misnamed(files):
    """Returns a sentence for each type of core and trainer with a name that has another meaning elsewhere.

    `files` are pairs of name and text."""
    places, faults = {}, []
    for name, text in files:
        for match in TYPE.finditer(text):
            own = match["name"]
            first = places.setdefault(own, name) if match["public"] else name
            if first != name:
                faults.append(f"{name}: {own} is also a public type of {first}: name one of them after what it adds")
            for word in re.findall(r"[A-Z][a-z]+", own):
                if word in HOMES and not re.search(HOMES[word], name):
                    faults.append(f"{name}: {own} has the word {word}, whose home is {HOMES[word]}")
    return faults


def self_test():
    openers, banned = findings("a.rs", '/// What it does.\n/// It is no longer so.\nlet x = "none besides";\n// Why?\n')
    assert [line for line, _ in openers] == [1] and [line for line, _ in banned] == [3], (openers, banned)
    openers, banned = findings("a.md", "# How to train\n\n```sh\n# What?\n```\n- it is told\n  anew\n")
    assert len(openers) == 1 and len(banned) == 2, (openers, banned)
    faults = misnamed([("a.rs", "pub struct A;\nstruct B;\nenum TrainingPlan {}\n"), ("b.rs", "pub trait A {}\nstruct B;\n")])
    assert len(faults) == 2, faults


def main():
    self_test()
    files = subprocess.run(["git", "ls-files"], check=True, capture_output=True, text=True).stdout.split()
    files = [name for name in files if ending(name) in READERS and name != "tests/check_language.py"]
    counts = {"openers": 0, "banned words": 0}
    for name in files:
        for kind, found in zip(counts, findings(name, open(name, encoding="utf-8").read())):
            counts[kind] += len(found)
            if "--list" in sys.argv:
                for line, sentence in found:
                    print(f"{name}:{line}: {sentence}")
    named = [name for name in files if re.match(r"(core|trainer/(?!fuzz)\w+)/src/.*\.rs$", name)]
    if faults := misnamed((name, open(name, encoding="utf-8").read()) for name in named):
        sys.exit("\n".join(faults))
    ceilings = {"openers": OPENERS_CEILING, "banned words": BANNED_CEILING}
    print(", ".join(f"{kind}: {count} (at most {ceilings[kind]})" for kind, count in counts.items()))
    if any(counts[kind] > ceilings[kind] for kind in counts):
        sys.exit("a count exceeds its ceiling: list the findings with `python3 tests/check_language.py --list`, "
                 "and rewrite those in text that you changed")


if __name__ == "__main__":
    main()
