"""HTML pages that load nothing: a template filled in, and figures as data inside it."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape
from matplotlib.figure import Figure

from pdhocbf_drake.analysis.drawing import save, styled


def filled_page(room: str, filters: dict[str, Callable[..., str]] | None = None, **values: Any) -> str:
    """The room's `report.html.j2` with its values; text is escaped, and a missing value is an error."""
    environment = Environment(
        loader=PackageLoader(f"pdhocbf_drake.{room}", "."),
        autoescape=select_autoescape(default=True),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(filters or {})
    return environment.get_template("report.html.j2").render(**values)


def png(figure: Figure) -> bytes:
    """A figure as the bytes of a PNG."""
    picture = io.BytesIO()
    with styled():
        save(figure, picture)
    return picture.getvalue()


def data_url(image: bytes) -> str:
    """A PNG as a `data:` URL."""
    return "data:image/png;base64," + base64.b64encode(image).decode("ascii")
