"""YAML files read, written and merged: numbers as in YAML 1.2, errors for duplicate keys, maps merged in depth."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import yaml
from yaml.constructor import ConstructorError

from pdhocbf_drake.config_errors import shown
from pdhocbf_drake.errors import InputError

# Numbers of YAML 1.2. PyYAML reads version 1.1, in which 1e4 is text, 010 is 8 and 1:30 is 90.
_INT = re.compile(r"^(?:[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+)$")
_FLOAT = re.compile(
    r"^(?:[-+]?(?:\.[0-9]+|[0-9]+\.[0-9]*)(?:[eE][-+]?[0-9]+)?|[-+]?[0-9]+[eE][-+]?[0-9]+"
    r"|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$"
)
_NUMBERS = {"tag:yaml.org,2002:int": _INT, "tag:yaml.org,2002:float": _FLOAT}
_PLAIN = {f"tag:yaml.org,2002:{name}" for name in ("null", "bool", "int", "float", "str", "seq", "map", "merge")}
_MOST_VALUES = 1_000_000  # of a file with its aliases replaced by their values
_MOST_CHARACTERS = 100_000_000  # of a file


class _Loader(yaml.SafeLoader):
    """PyYAML's safe loader with YAML 1.2 numbers, plain values only, and an error for a duplicate key."""

    def get_single_data(self) -> Any:
        node = self.get_single_node()
        if node is None:
            return None
        _check(node, {})
        return self.construct_document(node)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        keys = set()
        for key_node, _ in node.value:
            key = key_node.value
            if key in keys:
                raise ConstructorError(None, None, f"key '{key}' is given twice", key_node.start_mark)
            keys.add(key)
        return super().construct_mapping(node, deep)


def _check(node: yaml.Node, counts: dict[int, int | None]) -> int:
    """The number of values of a node, with its aliases replaced by their values.

    Raises:
        ConstructorError: the node is no tree of plain values, or has too many.
    """
    if id(node) in counts:
        counted = counts[id(node)]
        if counted is None:
            raise ConstructorError(None, None, "a value holds itself", node.start_mark)
        return counted
    counts[id(node)] = None
    if node.tag not in _PLAIN:
        tag = node.tag.replace("tag:yaml.org,2002:", "!!")
        raise ConstructorError(None, None, f"{tag} is no plain value", node.start_mark)
    total = 1
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            if not isinstance(key, yaml.ScalarNode):
                raise ConstructorError(None, None, "a key must be a word", key.start_mark)
            total += _check(key, counts) + _check(value, counts)
    elif isinstance(node, yaml.SequenceNode):
        total += sum(_check(value, counts) for value in node.value)
    if total > _MOST_VALUES:
        raise ConstructorError(None, None, f"more than {_MOST_VALUES} values", node.start_mark)
    counts[id(node)] = total
    return total


def _integer(loader: _Loader, node: yaml.ScalarNode) -> int:
    return int(node.value, 0 if node.value[:2] in ("0x", "0o") else 10)


class _Dumper(yaml.SafeDumper):
    """Quotes text that is a number in either version of YAML."""


_Loader.yaml_implicit_resolvers = {
    # Dates are read as text, since no key takes one, and the message about text is clearer.
    first: [(tag, pattern) for tag, pattern in pairs if tag not in _NUMBERS and not tag.endswith(":timestamp")]
    for first, pairs in _Loader.yaml_implicit_resolvers.items()
}
_Loader.add_constructor("tag:yaml.org,2002:int", _integer)
for _tag, _pattern in _NUMBERS.items():
    for _class in (_Loader, _Dumper):
        _class.add_implicit_resolver(_tag, _pattern, list("-+.0123456789"))


def parse_yaml(text: str, where: str) -> Any:
    """Plain data from YAML text; raises `InputError` with the line and column of a mistake."""
    try:
        return yaml.load(text, Loader=_Loader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = f" at line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        problem = " ".join(str(getattr(error, "problem", error)).split())
        raise InputError(f"{where} is not valid YAML{place}: {problem}") from None
    except RecursionError:
        raise InputError(f"{where} is not valid YAML: lists or maps are nested too deeply") from None


def parse_settings(text: str, where: str) -> dict[str, Any]:
    """The map of settings in YAML text, or in that text put in braces, as `a: 1, b: 2` needs; raises `InputError`."""
    try:
        data = parse_yaml(text, where)
    except InputError:
        if text.lstrip()[:1] in ("{", "["):
            raise
        try:
            data = parse_yaml(f"{{{text}\n}}", where)
        except InputError:
            data = None
        if not isinstance(data, dict):
            raise
    if not isinstance(data, dict):
        raise InputError(f"{where} must hold a YAML map such as 'gait: {{stride: 0.1}}', given {shown(text)}")
    return data


def read_yaml(path: Path) -> Any:
    """Plain data from a YAML file; raises `InputError`."""
    try:
        with path.open(encoding="utf-8") as file:
            text = file.read(_MOST_CHARACTERS + 1)
    except FileNotFoundError:
        raise InputError(f"file {path} does not exist") from None
    except IsADirectoryError:
        raise InputError(f"{path} is a folder; a YAML file is needed, such as the scenario.yaml of a run") from None
    except OSError as error:
        raise InputError(f"file {shown(str(path))} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"file {path} cannot be read: it is no UTF-8 text") from None
    except ValueError:  # a NUL byte
        raise InputError(f"no file can be called {shown(str(path))}") from None
    if len(text) > _MOST_CHARACTERS:
        raise InputError(f"file {path} is no YAML file of settings: it has more than {_MOST_CHARACTERS} characters")
    return parse_yaml(text, str(path))


def merge(base: Any, over: Any) -> Any:
    """`base` with the values of `over`: maps merge key by key, any other value replaces the old one.

    A map with another `kind` replaces the old map as a whole, since the old keys belong to the old kind.
    """
    if not (isinstance(base, dict) and isinstance(over, dict)):
        return over
    if "kind" in over and over["kind"] != base.get("kind"):
        return over
    return {**base, **{key: merge(base[key], value) if key in base else value for key, value in over.items()}}


def write_yaml(data: Any, path: Path, head: str = "") -> None:
    """Writes plain data, with its keys in their order; with a `head`, a comment, it is written for people to edit."""
    flow = None if head else False  # None: the innermost lists and maps on lines of their own
    text = yaml.dump(data, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100, default_flow_style=flow)
    path.write_text(f"# {head}\n{text}" if head else text, encoding="utf-8")
