"""Builds the documents as a site in target/site with mdBook, and checks its links.

    python3 tests/site/build.py

The documents stay where they are: this copies them, and the files that they link to, into mdBook's source folder.
"""
import html.parser, re, shutil, subprocess, sys
from pathlib import Path
from urllib.parse import unquote

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
SITE = ROOT / "target/site"
SOURCE = SITE / "src"
LINK = re.compile(r"(\]\()([^)#\s]*)(#[^)\s]*)?(\))")


def tracked(*patterns):
    """Returns the paths of committed and new files that match."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", *patterns]
    return [Path(line) for line in subprocess.run(command, cwd=ROOT, check=True, text=True, stdout=subprocess.PIPE).stdout.splitlines()]


def page(path):
    """Returns the path of a document in the site: mdBook's name of a folder's first page is index.md."""
    return path.with_name("index.md") if path.name == "README.md" else path


def copy_document(path):
    """Copies a document. Links to folders lead to their first page, or else disappear. Returns the linked files."""
    files = []

    def target(match):
        before, name, anchor, after = match.groups()
        if not name or "://" in name or name.startswith("mailto:"):
            return match.group(0)
        linked = (ROOT / path.parent / name).resolve()
        relative = Path(name)
        if linked.is_dir():
            if not (linked / "README.md").exists():
                return f"{before}{after}"
            relative /= "index.md"
        elif linked.suffix == ".md":
            relative = page(relative)
        else:
            files.append(linked.relative_to(ROOT))
        return f"{before}{relative.as_posix()}{anchor or ''}{after}"

    parts = (ROOT / path).read_text().split("```")
    parts[::2] = [re.sub(r"\[([^\]]*)\]\(\)", r"\1", LINK.sub(target, part)) for part in parts[::2]]
    out = SOURCE / page(path)
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text("```".join(parts))
    return files


class Links(html.parser.HTMLParser):
    """The links and the anchors of a page."""

    def __init__(self, text):
        super().__init__()
        self.links, self.anchors = [], set()
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.anchors.update(filter(None, [attributes.get("id"), attributes.get("name") if tag == "a" else None]))
        self.links.extend(filter(None, [attributes.get("href"), attributes.get("src")]))


def dead_links(site):
    """Returns a line for each link of the site to a file or an anchor that does not exist."""
    pages = {path.resolve(): Links(path.read_text()) for path in site.rglob("*.html")}
    dead = []
    for path, links in pages.items():
        # The error page has its links relative to the server's root.
        if path.name == "404.html":
            continue
        for link in links.links:
            if re.match(r"[a-z]+:|//", link):
                continue
            name, _, anchor = unquote(link).partition("#")
            linked = (path.parent / name).resolve() if name else path
            linked = linked / "index.html" if linked.is_dir() else linked
            if not linked.exists():
                dead.append(f"{path.relative_to(site)}: no file {link}")
            elif anchor and linked in pages and anchor not in pages[linked].anchors:
                dead.append(f"{path.relative_to(site)}: no anchor {link}")
    return dead


def main():
    shutil.rmtree(SITE, ignore_errors=True)
    SOURCE.mkdir(parents=True)
    documents = tracked("*.md")
    documents.remove(Path("tests/site/SUMMARY.md"))
    # Its links are valid where it is. In the site, it is beside the first page.
    summary = re.sub(r"\]\(\.\./\.\./([^)]+)\)", lambda link: f"]({page(Path(link[1]))})", (HERE / "SUMMARY.md").read_text())
    listed = {Path(name) for name in re.findall(r"\]\(([^)]+)\)", summary)}
    missing = {page(path) for path in documents} - listed
    if missing:
        sys.exit(f"SUMMARY.md lacks {', '.join(map(str, sorted(missing)))}: add them")
    stale = listed - {page(path) for path in documents}
    if stale:
        sys.exit(f"SUMMARY.md lists {', '.join(map(str, sorted(stale)))}, which do not exist: remove them")
    files = {file for path in documents for file in copy_document(path)}
    absent = sorted(str(file) for file in files if not (ROOT / file).is_file())
    if absent:
        sys.exit(f"documents link to {', '.join(absent)}, which do not exist: correct the links")
    for file in files:
        out = SOURCE / file
        out.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / file, out)
    (SOURCE / "SUMMARY.md").write_text(summary)
    shutil.copy(HERE / "book.toml", SITE)
    subprocess.run(["mdbook", "build", str(SITE)], check=True)
    book = SITE / "book"
    dead = dead_links(book.resolve())
    print("\n".join(dead))
    if dead:
        sys.exit(f"{len(dead)} links of the site are dead: correct the documents")
    print(f"{len(documents)} pages: {book / 'index.html'}")


main()
