"""The commands of the documentation: every option is one that the program has, and what a page says is printed is what is printed."""

import functools
import os
import re
import shlex
import subprocess

import pytest

from tests.book.pages import PAGES, ROOT, blocks, name, prose

PROGRAM = ROOT / "target" / "release" / "touchdown"
WRITE = os.environ.get("TOUCHDOWN_WRITE") == "1"


@functools.cache
def help_of(*words):
    """What --help prints of a command."""
    asked = subprocess.run([PROGRAM, *words, "--help"], capture_output=True, text=True, check=False)
    assert asked.returncode == 0, f"touchdown {' '.join(words)} is no command: {asked.stderr}"
    return asked.stdout


def calls(page):
    """(line from 1, words) of every call of the program in a page: in its sh blocks and in its text."""
    found = []
    for b in blocks(page):
        if b.words[:1] == ["sh"]:
            text = b.text.replace("\\\n", "  ")
            found += [(b.first + 1, m) for m in re.findall(r"^\s*(?:\w+=\S+ )*(?:harness/)?touchdown +([a-z][^\n|;]*)", text, re.M)]
    for line, text in prose(page):
        found += [(line, m) for m in re.findall(r"`(?:harness/)?touchdown ([a-z][^`]*)`", text)]
    return [(line, shlex.split(m, comments=True)) for line, m in found]


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_the_program_has_every_command_and_option(page):
    wrong = []
    for line, words in calls(page):
        command = words[:2] if words[0] == "study" else words[:1]
        for option in (w.partition("=")[0] for w in words if w.startswith("--")):
            if not re.search(rf"(?<![\w-]){option}(?![\w-])", help_of(*command)):
                wrong.append(f"{name(page)}:{line}: touchdown {' '.join(command)} has no {option}")
        help_of(*command)
    assert not wrong, "\n".join(wrong)


def runnable(page):
    """The blocks of a page that are run: (block, the text block with what it prints, or None)."""
    every = blocks(page)
    lines = page.read_text().splitlines()
    found = []
    for i, b in enumerate(every):
        if b.words != ["sh"]:
            continue
        after = every[i + 1] if i + 1 < len(every) else None
        follows = after is not None and after.words == ["text"] and not "".join(lines[b.last + 1:after.first - 1]).strip()
        found.append((b, after if follows else None))
    return found


def without_platforms(text):
    """Text printed, without the platforms that an FMU runs on: those whose libraries lie ready in this checkout."""
    return re.sub(r"(; it runs on |\.fmu: (?=linux64))[^\n]*", r"\1...", text)


@pytest.mark.parametrize("page", [p for p in PAGES if p != ROOT / "README.md" and runnable(p)], ids=name)
def test_the_commands_of_a_page_run_in_an_empty_folder_and_print_what_it_says(page, tmp_path):
    search = [PROGRAM.parent, ROOT / "target" / "venv" / "bin", os.environ["PATH"]]
    env = {**os.environ, "PATH": ":".join(map(str, search)), "CHECKOUT": str(ROOT)}
    lines, moved = page.read_text().splitlines(), 0
    for b, expected in runnable(page):
        ran = subprocess.run(["sh", "-e", "-c", b.text], cwd=tmp_path, env=env, capture_output=True, text=True, check=False)
        assert ran.returncode == 0, f"{name(page)}:{b.first + 1}: exit code {ran.returncode}\n{b.text}\n{ran.stdout}\n{ran.stderr}"
        if expected is None:
            continue
        printed = ran.stdout.rstrip("\n").replace(str(ROOT), "$CHECKOUT")
        same = without_platforms(printed) == without_platforms(expected.text)
        if WRITE and not same:
            lines[expected.first + moved:expected.last + moved] = printed.split("\n")
            moved += printed.count("\n") + 1 - (expected.last - expected.first)
            page.write_text("\n".join(lines) + "\n")
        else:
            assert same, f"{name(page)}:{expected.first + 1}: write it anew with TOUCHDOWN_WRITE=1"
