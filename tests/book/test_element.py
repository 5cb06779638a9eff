"""The page of the element holds the variables of its model description."""

import os
import xml.etree.ElementTree as ElementTree

from tests.book.pages import ROOT, SOURCE

PAGE = SOURCE / "formats" / "element.md"
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


def tables():
    """Tables of the inputs, outputs and parameters of modelDescription.xml."""
    root = ElementTree.parse(ROOT / "modelDescription" / "modelDescription.xml").getroot()
    variables = root.find("ModelVariables")
    items = {t.get("name"): [i.get("name") for i in t.iter("Item")] for t in root.find("TypeDefinitions")}
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


def test_the_page_holds_the_variables_of_the_model_description():
    text = PAGE.read_text()
    before, _, rest = text.partition(START + "\n")
    held, found, after = rest.partition(END)
    assert found, f"{PAGE}: the markers are missing"
    if held != "\n" + tables() + "\n" and os.environ.get("TOUCHDOWN_WRITE") == "1":
        PAGE.write_text(f"{before}{START}\n\n{tables()}\n{END}{after}")
        return
    assert held == "\n" + tables() + "\n", "write it anew with TOUCHDOWN_WRITE=1"
