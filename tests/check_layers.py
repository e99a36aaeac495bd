#!/usr/bin/env python3
"""Checks the imports of crates: no cycles between files or layers, and no imports of a higher layer.

    python3 tests/check_layers.py CRATE/src...
    python3 tests/check_layers.py --self-test      # checks the script itself on synthetic crates

A file depends on every file whose items it names: in `use`, `pub use`, `super::` or a path in the code. A re-exported
item belongs to the file that defines it. Two kinds of imports are ignored: those of unit tests, and a `pub use` in a
folder's `mod.rs` that re-exports items of the folder.

A layer is a folder or a file next to `lib.rs`. If the comment of `lib.rs` lists the layers from the bottom up, in lines
"//! - [`layer`]: description", a layer may import only layers listed before it."""
import re, sys, tempfile
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

COMMENT_OR_LITERAL = re.compile(r'//[^\n]*|/\*.*?\*/|r#*"[^"]*"#*|"(?:\\.|[^"\\])*"|' r"'(?:\\.|[^'\\])'", re.S)
ITEM = r"\b(?:struct|enum|fn|trait|type|const|static|mod) "
ROOTS = ("lib", "main")

def change_blocks(text, opening, change):
    """Changes each block of the text that starts with `opening` and ends at the matching brace."""
    for match in reversed(list(re.finditer(opening, text))):
        depth, end = 1, match.end()
        while depth and end < len(text):
            depth += {"{": 1, "}": -1}.get(text[end], 0)
            end += 1
        text = text[:match.start()] + change(text[match.start():end]) + text[end:]
    return text

def imports(tree):
    """Returns the imports of a `use`: a::{b, c as d} gives the path a::b with the name b, and a::c with the name d."""
    prefix, brace, rest = tree.partition("{")
    if not brace:
        path, _, name = tree.partition(" as ")
        path = [part for part in path.strip().split("::") if part]
        path = path[:-1] if path[1:] and path[-1] == "self" else path
        return [(path, name.strip() or path[-1])] if path else []
    parts = re.findall(r"(?:[^,{}]|\{(?:[^{}]|\{[^{}]*\})*\})+", rest.rsplit("}", 1)[0])
    return [pair for part in parts if part.strip() for pair in imports(prefix.strip() + part.strip())]

class Crate:
    """The files of a crate and their dependencies."""
    def __init__(self, root):
        self.root = root
        # By module, a tuple of names: its file, its text without imports, its imports, and all paths in it.
        self.files, self.texts, self.uses, self.paths = {}, {}, {}, {}
        for name in ROOTS:
            if (root / f"{name}.rs").exists():
                self.read((name,), root / f"{name}.rs", root)
        pairs = {(module, self.find(module, path)) for module in self.files for path in self.paths[module]}
        self.dependencies = {(self.files[a], self.files[b]) for a, b in pairs if b and a != b}
    def read(self, module, file, folder):
        """Reads a module and its submodules, which are in `folder`."""
        text = COMMENT_OR_LITERAL.sub(lambda match: "" if match[0][0] == "/" else '""', file.read_text())
        # The macro `internal!` of core makes modules and imports public with the feature `training`.
        text = re.sub(r"\binternal! \{ (mod \w+) \}", r"pub \1;", text)
        text = re.sub(r"\binternal! \{ ([^$]*?\}?) \}\n", r"pub use \1;\n", text)
        text = change_blocks(text, r"#\[cfg\(test\)\]\s*mod \w+ \{", lambda block: "")
        text = re.sub(r"#\[cfg\((?:test|doc)\)\]\s*(pub )?(mod|use) [^;]*;", "", text)
        # An inline module counts as its file, so its `super` is the file.
        text = change_blocks(text, r"\bmod [\w$]+ \{", lambda block: block.replace("super::", "self::"))
        children = re.findall(r"\bmod (\w+);", text)
        uses = [(pub, pair) for pub, tree in re.findall(r"\b(pub\b[^;{]*?)?\buse ([^;]+);", text)
                for pair in imports(" ".join(tree.split()))]
        self.files[module], self.texts[module] = file, re.sub(r"\buse [^;]+;", "", text)
        self.uses[module] = [pair for _, pair in uses]
        inline = re.findall(r"(?<![\w:$])\w+(?:::\w+)+", self.texts[module])
        self.paths[module] = [path.split("::") for path in inline] + [
            path for pub, (path, _) in uses if not (pub and {*path[:2]} & {*children})]
        for name in children:
            for child in (folder / f"{name}.rs", folder / name / "mod.rs"):
                if child.exists():
                    self.read((*module, name), child, folder / name)
    def find(self, module, path, seen=()):
        """Returns the module that a path names, or that defines the named item; None for other crates."""
        here, rest = module, list(path)
        if rest and rest[0] == "crate":
            here, rest = module[:1], rest[1:]
        elif rest and rest[0] not in ("self", "super") and (*here, rest[0]) not in self.files:
            return self.find_import(here, rest, seen)
        while rest and rest[0] in ("self", "super"):
            here, rest = (here[:-1] if rest[0] == "super" else here), rest[1:]
        for index, name in enumerate(rest):
            if (*here, name) not in self.files:
                return self.find_import(here, rest[index:], seen) or here
            here = (*here, name)
        return here
    def find_import(self, module, path, seen):
        """Returns the module that defines a name, if `module` imports that name."""
        for target, name in self.uses.get(module, []):
            step = (module, path[0], tuple(target))
            if name == path[0] and step not in seen:
                return self.find(module, [*target, *path[1:]], (*seen, step))
            origin = name == "*" and step not in seen and self.find(module, target[:-1], (*seen, step))
            if origin and re.search(rf"{ITEM}{path[0]}\b", self.texts[origin]):
                return origin
    def errors(self):
        """Returns a message for each cycle, each unlisted layer, and each import of a higher layer."""
        layer = lambda file: file.relative_to(self.root).parts[0].removesuffix(".rs")
        layers = {(layer(a), layer(b)) for a, b in self.dependencies}
        layers = {(a, b) for a, b in layers if a != b and a not in ROOTS and b not in ROOTS}
        cycles = find_cycle(self.dependencies) + find_cycle(layers)
        errors = [f"import cycle: {cycle}: remove one of these imports" for cycle in cycles]
        lib = self.root / "lib.rs"
        order = re.findall(r"^//! - \[?`(\w+)`", lib.read_text(), re.M) if lib.exists() else []
        unlisted = {layer(file) for file in self.files.values()} - {*order, *ROOTS}
        errors += [f"{lib} does not list the layer {name}: add it" for name in sorted(unlisted) if order]
        return errors + [f"{lib}: {a} imports {b}, which is a higher layer: remove the import"
                         for a, b in sorted(layers) if {a, b} <= {*order} and order.index(a) < order.index(b)]

def find_cycle(dependencies):
    """Returns a list with one cycle, or an empty list."""
    sorter = TopologicalSorter()
    for importer, imported in dependencies:
        sorter.add(importer, imported)
    try:
        sorter.prepare()
    except CycleError as error:
        return [" -> ".join(map(str, reversed(error.args[1])))]
    return []

def self_test():
    """Checks a valid crate and several invalid ones."""
    valid = {"lib.rs": "//! - [`a`]: low\n//! - [`b`]: high\npub mod a;\npub mod b;",
             "a/mod.rs": "mod x;\nmod y;\npub use x::{X, Z as W};\npub use y::Y;",
             "a/x.rs": "pub struct X; pub struct Z; // use crate::b::B;",
             "a/y.rs": "use super::X; pub struct Y(X); #[cfg(test)] mod tests { use crate::b::B; }",
             "b.rs": 'use crate::a::{self, W, Y}; pub struct B(Y); const C: &str = "crate::b";',
             "b/c.rs": "pub struct C(super::B);"}
    invalid = [("a/x.rs", "pub struct X; pub struct Z; fn f(_: super::Y) {}"),
               ("a/y.rs", "use crate::b::B; pub struct Y(super::X);"),
               ("a/mod.rs", "mod x; mod y; pub use x::X; pub use y::Y; fn f() { crate::b::g() }"),
               ("lib.rs", "//! - [`b`]: low\n//! - [`a`]: high\nmod a;\nmod b;"),
               ("b.rs", "mod c; use crate::a::Y; pub struct B(c::C);")]
    for name, text in [("lib.rs", valid["lib.rs"]), *invalid]:
        with tempfile.TemporaryDirectory() as folder:
            for path, content in {**valid, name: text}.items():
                (Path(folder) / path).parent.mkdir(exist_ok=True)
                (Path(folder) / path).write_text(content)
            errors = Crate(Path(folder)).errors()
            assert bool(errors) == (text != valid[name]), (name, text, errors)

if __name__ == "__main__":
    if sys.argv[1:] == ["--self-test"]:
        sys.exit(self_test())
    errors = [line for root in sys.argv[1:] for line in Crate(Path(root)).errors()]
    sys.exit("\n".join(errors) or None)
