"""Every key that the program reads or writes stands on the page of its format."""

import re

import pytest

from tests.book.pages import ROOT, SOURCE, prose

FIELD = r"^    (?!.*skip\)).*?pub (\w+): "
# page: the sources that declare its keys, and what a declaration looks like
KEYS = {
    "recordings": [("harness/record/src/keys.rs", r'Key\("(\w+)"'), ("harness/record/src/lib.rs", r'Kind::\w+ => "([a-z-]+)"')],
    "scenarios": [("harness/scenario/src/file.rs", FIELD), ("harness/scenario/src/contact.rs", r"^    pub (penetration|velocity|force|a|b|youngs_modulus|poisson_ratio|macro_step|fmu|variables|parameters|faces): "),
                  *((f"harness/mechanisms/src/{m}.rs", r'Key \{\s*name: "(\w+)"') for m in ("guide_friction", "fluid_drag", "squeeze_film", "return_spring", "residual_magnetism")),
                  ("harness/scenario/src/results.rs", r'^        \("([a-z ]+) \[')],
    "systems": [("harness/host/src/master/system.rs", FIELD)],
    "verdict": [("harness/diagnose/src/verdict/mod.rs", FIELD), ("harness/diagnose/src/material.rs", r"^    pub (peak_force|restitution|contact_time|depth|share_of_range|text): ")],
}
# fields that are no keys: of the file itself, and one that has another name in it
NO_KEYS = {"systems": {"path", "text", "folder", "keep", "isolation", "notes"}, "verdict": {"places"}}


def keys(page):
    found = [k for file, pattern in KEYS[page] for k in re.findall(pattern, (ROOT / file).read_text(), re.M)]
    return set(found) - NO_KEYS.get(page, set())


@pytest.mark.parametrize("page", KEYS)
def test_the_page_names_every_key(page):
    words = set()
    for code in re.findall(r"`([^`]+)`", "\n".join(line for _, line in prose(SOURCE / "formats" / f"{page}.md"))):
        words.update(re.findall(r"[\w-]+", code))
        words.add(code)
    wanted = keys(page)
    assert len(wanted) > 15
    assert not wanted - words, f"docs/src/formats/{page}.md does not name {', '.join(sorted(wanted - words))}"


def test_how_often_intervals_hold_is_what_the_proof_says():
    proof = (SOURCE / "proof.md").read_text()
    many, share = re.search(r"^\| parameters inside their 95 % interval [^|]*\| (\d+) \| (\d+) %", proof, re.M).groups()
    assert f"{share} % of {many} parameters lay inside theirs" in (SOURCE / "formats/verdict.md").read_text()
