"""Pages: one self-contained HTML file each, made from templates.

What comes from data is escaped by the template engine. A page may run no script but this folder's `animation.js`, and
loads nothing: its content-security policy says so to the browser.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Callable, Mapping
from functools import cache
from importlib.resources import files
from typing import Any

SCRIPT = "animation.js"
Filters = Mapping[str, Callable[..., str]]


def render(
    template: str,
    contents: Mapping[str, Any],
    filters: Filters | None = None,
) -> str:
    """The text of a page. `template`: a file of this folder, or a path below the package.

    `filters`: what the template calls beside Jinja's own.
    """
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    places = [PackageLoader("testbed.report", "."), PackageLoader("testbed", ".")]
    environment = Environment(
        loader=ChoiceLoader(places), autoescape=True, trim_blocks=True, undefined=StrictUndefined
    )
    environment.filters.update(filters or {})
    environment.globals.update(policy=policy(), script=Markup(_script()))
    return environment.get_template(template).render(**contents)


def policy() -> str:
    """The content-security policy of every page: our script by its hash, styles, and pictures that the page holds."""
    digest = base64.b64encode(hashlib.sha256(_script().encode()).digest()).decode()
    return (
        f"default-src 'none'; script-src 'sha256-{digest}'; style-src 'unsafe-inline'; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )


@cache
def _script() -> str:
    return files("testbed.report").joinpath(SCRIPT).read_text(encoding="utf-8")
