"""The page on simulators gives the same lookaheads as the documentation inside the FMU."""

import html
import re

from tests.book.pages import ROOT, SOURCE


def rows_of_the_fmu():
    text = (ROOT / "modelDescription" / "documentation" / "cosimulation.html").read_text()
    rows = re.findall(r"<tr><td>(.*?)</td>\s*<td>(.*?)</td>\s*<td>(.*?)</td></tr>", text, re.S)
    return [(lookahead, " ".join(html.unescape(run).split())) for _, lookahead, run in rows]


def rows_of_the_page():
    text = (SOURCE / "how-to" / "simulator.md").read_text()
    table = text[text.index("| how the host steps"):].split("\n\n")[0]
    return [tuple(line.strip("| ").split(" | ")[1:]) for line in table.splitlines()[2:]]


def test_lookaheads_and_where_they_were_run_are_those_of_the_fmu_s_documentation():
    assert len(rows_of_the_fmu()) == 5
    assert rows_of_the_page() == rows_of_the_fmu()
