"""The pages of the book and the files beside it that link into it: their fenced blocks, headings and links."""

import dataclasses
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]
SOURCE = ROOT / "docs" / "src"
BOOK = sorted(SOURCE.rglob("*.md"))
PAGES = [p for p in (ROOT / "README.md", ROOT / "CHANGELOG.md", ROOT / "CONTRIBUTING.md") if p.exists()] + BOOK
FENCE = "```"


@dataclasses.dataclass
class Block:
    """A fenced block: the words of its first line, its text, and where its text stands: lines first to last, from 0, without last."""
    words: list
    text: str
    first: int
    last: int


def name(page):
    """Its path from the root of the repository."""
    return page.relative_to(ROOT).as_posix()


def blocks(page):
    """The fenced blocks of a page, in order."""
    found, opened = [], None
    lines = page.read_text().splitlines()
    for i, line in enumerate(lines):
        if not line.startswith(FENCE):
            continue
        if opened is None:
            opened = (i, line[len(FENCE):].replace(",", " ").split())
        else:
            found.append(Block(opened[1], "\n".join(lines[opened[0] + 1:i]), opened[0] + 1, i))
            opened = None
    assert opened is None, f"{name(page)}:{opened[0] + 1}: this block is not closed"
    return found


def prose(page):
    """(line from 1, text) of what stands outside of fenced blocks."""
    inside = {i for b in blocks(page) for i in range(b.first - 1, b.last + 1)}
    return [(i + 1, line) for i, line in enumerate(page.read_text().splitlines()) if i not in inside]


def anchor(heading):
    """The id that mdbook gives a heading."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").strip()
    kept = (c.lower() for c in text if c.isalnum() or c in "_-" or c.isspace())
    return "".join("-" if c.isspace() else c for c in kept)


def anchors(page):
    """All ids of a page; of headings that are alike the further ones have a number."""
    found = []
    for _, line in prose(page):
        if m := re.match(r"#{1,6} (.+)", line):
            a, n = anchor(m[1]), 0
            while (a if n == 0 else f"{a}-{n}") in found:
                n += 1
            found.append(a if n == 0 else f"{a}-{n}")
        found += re.findall(r'<[a-z]+ id="([^"]+)"', line)
    return found


def links(page):
    """(line from 1, target) of every link and picture."""
    found = []
    for i, line in prose(page):
        bare = re.sub(r"`[^`]*`", "", line)
        found += [(i, t) for t in re.findall(r"\]\(<?([^)\s>]+)>?\)", bare)]
        found += [(i, t) for t in re.findall(r'(?:src|href)="([^"]+)"', bare)]
    return found
