"""The paper's claims beside what was measured, as a table and as a self-contained page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from testbed import __version__
from testbed.report.page import render
from testbed.report.tables import Table

Tree = dict[str, Any]


def page(experiments: Sequence[Tree]) -> str:
    """The page's text, from what drawing.shown makes of each experiment."""
    claims = [c for e in experiments for c in e["claims"]]
    contents = {
        "experiments": experiments,
        "total": len(claims),
        "failed": [c for c in claims if not c["holds"]],
        "version": __version__,
    }
    return render("page.html.j2", contents, beside=__file__)


def table(experiments: Sequence[Tree]) -> Table:
    """All claims."""
    heads = ["figure", "claim", "expected", "measured", "unit", "holds"]
    rows = [
        [
            c["figure"],
            c["claim"],
            c["criterion"],
            c["shown"],
            c["unit"],
            "yes" if c["holds"] else "NO",
        ]
        for e in experiments
        for c in e["claims"]
    ]
    return Table("The paper's claims", heads, rows)
