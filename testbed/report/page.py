"""Pages: one self-contained HTML file each, made from the templates of this folder."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any


def render(
    template: str,
    contents: Mapping[str, Any],
    filters: Mapping[str, Callable[..., str]] | None = None,
) -> str:
    """The text of a page. `filters`: what the template calls beside Jinja's own."""
    from jinja2 import Environment, PackageLoader

    environment = Environment(
        loader=PackageLoader("testbed.report", "."), autoescape=True, trim_blocks=True
    )
    environment.filters.update(filters or {})
    return environment.get_template(template).render(**contents)
