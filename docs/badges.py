"""Draws the README's badges from pyproject.toml: `python docs/badges.py` writes `badge_NAME.svg` beside this file."""

from __future__ import annotations

import sys
from pathlib import Path

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

HERE = Path(__file__).parent
_LETTER, _ROOM = 6.6, 12  # width of a letter, and around a word [px]
_SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="20" role="img" aria-label="{name}: {text}">
<rect width="{width}" height="20" rx="3" fill="#0b5e8a"/><rect width="{left}" height="20" rx="3" fill="#444"/>
<g fill="#fff" font-family="Verdana,DejaVu Sans,sans-serif" font-size="11" text-anchor="middle">
<text x="{first}" y="14">{name}</text><text x="{second}" y="14">{text}</text></g></svg>
"""


def badges() -> dict[str, str]:
    """The text of each file by its name: what Python and Drake are needed, and the licence."""
    project = tomllib.loads((HERE.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    drake = next(need.removeprefix("drake") for need in project["dependencies"] if need.startswith("drake"))
    said = {"python": project["requires-python"], "drake": drake, "licence": project["license"]}
    return {f"badge_{name}.svg": _badge(name, text.replace(",", ", ")) for name, text in said.items()}


def _badge(name: str, text: str) -> str:
    text = text.replace("&", "&amp;").replace("<", "&lt;").replace(">=", "≥ ").replace(">", "&gt;")
    shown = text.replace("&lt;", "<")
    left, right = (round(_LETTER * len(word)) + _ROOM for word in (name, shown))
    return _SVG.format(width=left + right, left=left, first=left / 2, second=left + right / 2, name=name, text=text)


if __name__ == "__main__":
    for name, text in badges().items():
        (HERE / name).write_text(text, encoding="utf-8")
