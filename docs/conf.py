"""The documentation site: `make docs` builds it from the pages beside this file, the notebooks and the docstrings.

The source folder is the repository's, so that a link leads to the same page here and where the repository is shown.
"""

from __future__ import annotations

import os
import re
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from pydantic import BaseModel

import pdhocbf_drake

project = html_title = "pdhocbf_drake"
author = "the pdhocbf_drake authors"
version = release = pdhocbf_drake.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinxcontrib.programoutput",
]
root_doc = "docs/index"
include_patterns = ["*.md", "docs/*.md", "models/README.md", "notebooks/*.ipynb"]
html_theme = "furo"
html_extra_path = ["first_page"]  # leads from the site's root to the root document

myst_heading_anchors = 3
myst_enable_extensions = ["dollarmath"]
html_math_renderer = "mathml"
nb_execution_mode = "force"
nb_execution_timeout = 600
nb_execution_raise_on_error = True
nb_execution_in_temp = True
# In notebooks deprecated names of ours, of Drake or of NumPy are errors. What is left in build/jupyter_execute is what
# tests/test_notebooks.py looks at, in place of running them once more.
os.environ["PYTHONWARNINGS"] = "error::DeprecationWarning"

default_role = "code"  # in docstrings single backticks hold code
highlight_language = "none"  # of blocks that name none
napoleon_use_ivar = True
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"


def plain(app: object, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Makes reStructuredText of a docstring in plain text: bars are bars, and what is indented after ":" is code."""
    if lines and lines[0].startswith("Alias for field number"):
        lines.clear()  # a named tuple's own words for its fields, which its docstring describes
    for place, line in enumerate(lines):
        parts = line.split("`")
        parts[::2] = [re.sub(r"([|*])", r"\\\1", part) for part in parts[::2]]
        lines[place] = "`".join(parts)
        blank, follows = [*lines[place + 1 : place + 3], "x", "x"][:2]
        if line.endswith(":") and not blank and _indent(follows) > _indent(line):
            lines[place] += ":"


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())


def short(app: object, what: str, name: str, obj: object, *rest: object) -> tuple[str, str] | None:
    """No signature for a configuration, whose keys its docstring describes."""
    return ("", "") if isinstance(obj, type) and issubclass(obj, BaseModel) else None


def formula(translator: Any, node: nodes.math | nodes.math_block) -> None:
    """A formula as MathML, which browsers draw by themselves; MathJax would be loaded from a network."""
    translator.body.append(tex2mathml(node.astext(), as_block=isinstance(node, nodes.math_block)))
    raise nodes.SkipNode


def setup(app: Any) -> None:
    """Called by Sphinx; sections such as "Args:" are read after `plain`."""
    app.add_html_math_renderer("mathml", (formula, None), (formula, None))
    app.connect("autodoc-process-docstring", plain, priority=400)
    app.connect("autodoc-process-signature", short)
