"""YAML as users write it: 1e4 is a number, a key given twice is an error, and maps merge in depth."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import yaml

from pdhocbf_drake.errors import InputError


class _Loader(yaml.SafeLoader):
    """PyYAML's safe loader with YAML 1.2 numbers and no silent duplicates."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen = set()
        for key_node, _ in node.value:
            key = key_node.value
            if key in seen:
                raise yaml.constructor.ConstructorError(None, None, f"key '{key}' is given twice", key_node.start_mark)
            seen.add(key)
        return super().construct_mapping(node, deep)


# YAML 1.1, which PyYAML reads, takes 1e4 for a word because it has no point.
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"^[-+]?[0-9][0-9_]*(\.[0-9_]*)?[eE][-+]?[0-9]+$"), list("-+0123456789")
)
# A date is a word here: no key wants one, and a word gets the clearer message.
_Loader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in pairs if not tag.endswith(":timestamp")]
    for first, pairs in _Loader.yaml_implicit_resolvers.items()
}


def parse_yaml(text: str, where: str) -> Any:
    """Plain data from YAML text; raises `InputError` that says where the text is wrong."""
    try:
        return yaml.load(text, Loader=_Loader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = f" at line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        raise InputError(f"{where} is not valid YAML{place}: {getattr(error, 'problem', error)}") from None


def read_yaml(path: Path) -> Any:
    """Plain data from a YAML file; raises `InputError`."""
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"file {path} does not exist") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"file {path} cannot be read: {error}") from None
    return parse_yaml(text, str(path))


def merge(base: Any, over: Any) -> Any:
    """`over` laid on `base`: maps merge key by key, anything else replaces.

    A map that names another `kind` replaces the old one whole, since the old one's keys belong to the old kind.
    """
    if not (isinstance(base, dict) and isinstance(over, dict)):
        return over
    if "kind" in over and over["kind"] != base.get("kind"):
        return over
    return {**base, **{key: merge(base[key], value) if key in base else value for key, value in over.items()}}


def write_yaml(data: Any, path: Path) -> None:
    """Writes plain data, keys in their given order."""
    path.write_text(yaml.safe_dump(data, sort_keys=False, allow_unicode=True, width=100), encoding="utf-8")
