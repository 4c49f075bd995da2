"""Pages: one self-contained HTML file each, made from templates that extend `base.html.j2`.

Everything that a template is given is escaped, but for what it marks as safe: the figures, as SVG.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

Filters = Mapping[str, Callable[..., str]]


def render(
    template: str,
    contents: Mapping[str, Any],
    filters: Filters | None = None,
    beside: str = __file__,
) -> str:
    """The text of a page.

    `filters`: what the template calls beside Jinja's own. `beside`: a file of the folder that holds the template.
    """
    from jinja2 import Environment, FileSystemLoader

    folders = [Path(beside).parent, Path(__file__).parent]
    environment = Environment(loader=FileSystemLoader(folders), autoescape=True, trim_blocks=True)
    environment.filters.update(filters or {})
    return environment.get_template(template).render(**contents)
