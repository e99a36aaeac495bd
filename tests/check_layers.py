#!/usr/bin/env python3
"""Imports point down: `tests/check_layers.py CRATE/src ...` fails if files or rooms import in a circle, or a
room one above it; `--self-test` tries that on trees that are made up.

An arrow goes from a file to every file whose items it names: by `use`, `pub use`, `super::` or a path
in the text; what is re-exported is looked up where it is defined. Only two things may look up: unit
tests, and the `pub use` by which a folder's first file lists what is in the folder. A room is a folder
or a file beside `lib.rs`. If the comment of `lib.rs` lists the rooms, from the bottom up, as lines
"//! - [`room`]: what it is", a room imports only those that stand before it."""
import re, sys, tempfile
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

NOISE = re.compile(r'//[^\n]*|/\*.*?\*/|r#*"[^"]*"#*|"(?:\\.|[^"\\])*"|' r"'(?:\\.|[^'\\])'", re.S)
ITEM = r"\b(?:struct|enum|fn|trait|type|const|static|mod) "
TOPS = ("lib", "main")

def change(text, opening, how):
    """The text with each block that begins so changed."""
    for match in reversed(list(re.finditer(opening, text))):
        depth, end = 1, match.end()
        while depth and end < len(text):
            depth += {"{": 1, "}": -1}.get(text[end], 0)
            end += 1
        text = text[:match.start()] + how(text[match.start():end]) + text[end:]
    return text

def names(tree):
    """What a `use` brings: a::{b, c as d} is the path a::b, known as b, and a::c, known as d."""
    prefix, brace, rest = tree.partition("{")
    if not brace:
        path, _, name = tree.partition(" as ")
        path = [part for part in path.strip().split("::") if part]
        path = path[:-1] if path[1:] and path[-1] == "self" else path
        return [(path, name.strip() or path[-1])] if path else []
    parts = re.findall(r"(?:[^,{}]|\{(?:[^{}]|\{[^{}]*\})*\})+", rest.rsplit("}", 1)[0])
    return [pair for part in parts if part.strip() for pair in names(prefix.strip() + part.strip())]

class Tree:
    def __init__(self, root):
        self.root, self.file, self.text, self.uses, self.paths = root, {}, {}, {}, {}
        for top in TOPS:
            if (root / f"{top}.rs").exists():
                self.read((top,), root / f"{top}.rs", root)
        found = {(module, self.find(module, path)) for module in self.file for path in self.paths[module]}
        self.arrows = {(self.file[a], self.file[b]) for a, b in found if b and a != b}
    def read(self, module, file, folder):
        text = NOISE.sub(lambda noise: "" if noise[0][0] == "/" else '""', file.read_text())
        text = re.sub(r"\binternal! \{ (mod \w+) \}", r"pub \1;", text)
        text = re.sub(r"\binternal! \{ ([^$]*?\}?) \}\n", r"pub use \1;\n", text)
        text = change(text, r"#\[cfg\(test\)\]\s*mod \w+ \{", lambda block: "")
        text = re.sub(r"#\[cfg\((?:test|doc)\)\]\s*(pub )?(mod|use) [^;]*;", "", text)
        # A module within the file is the file, and its `super` too.
        text = change(text, r"\bmod [\w$]+ \{", lambda block: block.replace("super::", "self::"))
        children = re.findall(r"\bmod (\w+);", text)
        uses = [(pub, pair) for pub, tree in re.findall(r"\b(pub\b[^;{]*?)?\buse ([^;]+);", text)
                for pair in names(" ".join(tree.split()))]
        self.file[module], self.text[module] = file, re.sub(r"\buse [^;]+;", "", text)
        self.uses[module] = [pair for _, pair in uses]
        inline = re.findall(r"(?<![\w:$])\w+(?:::\w+)+", self.text[module])
        self.paths[module] = [path.split("::") for path in inline] + [
            path for pub, (path, _) in uses if not (pub and {*path[:2]} & {*children})]
        for name in children:
            for child in (folder / f"{name}.rs", folder / name / "mod.rs"):
                if child.exists():
                    self.read((*module, name), child, folder / name)
    def find(self, module, path, seen=()):
        """The module that a path names, or that defines what it names; None for other crates."""
        here, rest = module, list(path)
        if rest and rest[0] == "crate":
            here, rest = module[:1], rest[1:]
        elif rest and rest[0] not in ("self", "super") and (*here, rest[0]) not in self.file:
            return self.used(here, rest, seen)
        while rest and rest[0] in ("self", "super"):
            here, rest = (here[:-1] if rest[0] == "super" else here), rest[1:]
        for index, name in enumerate(rest):
            if (*here, name) not in self.file:
                return self.used(here, rest[index:], seen) or here
            here = (*here, name)
        return here
    def used(self, module, path, seen):
        """The module that a name comes from, if this one brings it in."""
        for target, known in self.uses.get(module, []):
            step = (module, path[0], tuple(target))
            if known == path[0] and step not in seen:
                return self.find(module, [*target, *path[1:]], (*seen, step))
            origin = known == "*" and step not in seen and self.find(module, target[:-1], (*seen, step))
            if origin and re.search(rf"{ITEM}{path[0]}\b", self.text[origin]):
                return origin
    def wrong(self):
        room = lambda file: file.relative_to(self.root).parts[0].removesuffix(".rs")
        rooms = {(room(a), room(b)) for a, b in self.arrows}
        rooms = {(a, b) for a, b in rooms if a != b and a not in TOPS and b not in TOPS}
        found = [f"in a circle: {each}" for each in circle(self.arrows) + circle(rooms)]
        lib = self.root / "lib.rs"
        order = re.findall(r"^//! - \[?`(\w+)`", lib.read_text(), re.M) if lib.exists() else []
        unlisted = {room(file) for file in self.file.values()} - {*order, *TOPS}
        found += [f"{lib} does not list {name}" for name in sorted(unlisted) if order]
        return found + [f"{lib}: {a} imports {b}, which stands above it" for a, b in sorted(rooms)
                        if {a, b} <= {*order} and order.index(a) < order.index(b)]

def circle(arrows):
    """One circle of them, if there is any."""
    sorter = TopologicalSorter()
    for importer, imported in arrows:
        sorter.add(importer, imported)
    try:
        sorter.prepare()
    except CycleError as error:
        return [" -> ".join(map(str, reversed(error.args[1])))]
    return []

def self_test():
    """A tree that is right, and others that are not."""
    right = {"lib.rs": "//! - [`a`]: low\n//! - [`b`]: high\npub mod a;\npub mod b;",
             "a/mod.rs": "mod x;\nmod y;\npub use x::{X, Z as W};\npub use y::Y;",
             "a/x.rs": "pub struct X; pub struct Z; // use crate::b::B;",
             "a/y.rs": "use super::X; pub struct Y(X); #[cfg(test)] mod tests { use crate::b::B; }",
             "b.rs": 'use crate::a::{self, W, Y}; pub struct B(Y); const C: &str = "crate::b";',
             "b/c.rs": "pub struct C(super::B);"}
    wrong = [("a/x.rs", "pub struct X; pub struct Z; fn f(_: super::Y) {}"),
             ("a/y.rs", "use crate::b::B; pub struct Y(super::X);"),
             ("a/mod.rs", "mod x; mod y; pub use x::X; pub use y::Y; fn f() { crate::b::g() }"),
             ("lib.rs", "//! - [`b`]: low\n//! - [`a`]: high\nmod a;\nmod b;"),
             ("b.rs", "mod c; use crate::a::Y; pub struct B(c::C);")]
    for name, text in [("lib.rs", right["lib.rs"]), *wrong]:
        with tempfile.TemporaryDirectory() as folder:
            for path, content in {**right, name: text}.items():
                (Path(folder) / path).parent.mkdir(exist_ok=True)
                (Path(folder) / path).write_text(content)
            found = Tree(Path(folder)).wrong()
            assert bool(found) == (text != right[name]), (name, text, found)

if __name__ == "__main__":
    if sys.argv[1:] == ["--self-test"]:
        sys.exit(self_test())
    found = [line for root in sys.argv[1:] for line in Tree(Path(root)).wrong()]
    sys.exit("\n".join(found) or None)
