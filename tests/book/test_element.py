"""The pages of the element and of the forces on the body hold the variables of their model descriptions."""

import os
import xml.etree.ElementTree as ElementTree

import pytest

from tests.book.pages import ROOT, SOURCE

PAGES = [("element.md", "modelDescription/modelDescription.xml"), ("body_force.md", "fmu/body_force/modelDescription.xml")]
START, END = "<!-- variables: TOUCHDOWN_WRITE=1 tests/book/run writes them -->", "<!-- end of variables -->"
TITLES = {"input": "Inputs", "output": "Outputs", "parameter": "Parameters"}


def span(value, items):
    """The range of a variable in words; of a choice its items by name."""
    if value.tag == "Enumeration":
        return ", ".join(f"`{i}`" for i in items[value.get("declaredType")])
    least, most = value.get("min"), value.get("max")
    if least and most:
        return f"{least} to {most}"
    return f"from {least} on" if least else (f"to {most}" if most else "")


def tables(description):
    """Tables of the inputs, outputs and parameters of a model description."""
    root = ElementTree.parse(ROOT / description).getroot()
    variables = root.find("ModelVariables")
    items = {t.get("name"): [i.get("name") for i in t.iter("Item")] for t in root.iter("SimpleType")}
    lines = []
    for causality, title in TITLES.items():
        lines += [f"## {title}", "", "| name | reference | unit | range | start | meaning |", "|---|---|---|---|---|---|"]
        for v in variables:
            if v.get("causality") == causality:
                value = v[0]
                unit = value.get("unit", {"Enumeration": "a choice", "Boolean": "true or false"}.get(value.tag, ""))
                meaning = v.get("description").replace("|", "\\|")
                lines.append(f"| `{v.get('name')}` | {v.get('valueReference')} | {unit} | {span(value, items)} | {value.get('start', '')} | {meaning} |")
        lines.append("")
    return "\n".join(lines)


@pytest.mark.parametrize(("page", "description"), PAGES)
def test_the_page_holds_the_variables_of_the_model_description(page, description):
    page, wanted = SOURCE / "formats" / page, "\n" + tables(description) + "\n"
    before, _, rest = page.read_text().partition(START + "\n")
    held, found, after = rest.partition(END)
    assert found, f"{page}: the markers are missing"
    if held != wanted and os.environ.get("TOUCHDOWN_WRITE") == "1":
        page.write_text(f"{before}{START}\n{wanted}{END}{after}")
        return
    assert held == wanted, "write it anew with TOUCHDOWN_WRITE=1"
