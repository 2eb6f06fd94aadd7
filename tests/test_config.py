"""Errors of configs: brief, in the words of YAML, with the key, the value and the limit."""

from __future__ import annotations

from typing import Annotated, Literal

import pytest
from pydantic import Field

from pdhocbf_drake.config import Config, Length, Name, as_name, parse_config, within
from pdhocbf_drake.config_errors import shown
from pdhocbf_drake.errors import InputError


class Inner(Config):
    size: Length = 1.0


class Thing(Config):
    name: Name = "thing"
    number: float = 0.0
    count: int = 0
    on: bool = False
    pair: tuple[float, float] = (0.0, 0.0)
    many: tuple[float, ...] = ()
    inner: Inner = Inner()
    by_name: dict[Name, Inner] = {}  # noqa: RUF012
    angle: Annotated[float, within(-1.0, 1.0, "rad")] = 0.0


@pytest.mark.parametrize(
    ("data", "says"),
    [
        ({"number": "a"}, "f.number: must be a number (given: 'a')"),
        ({"count": 1.5}, "f.count: must be a whole number (given: 1.5)"),
        ({"on": 1}, "f.on: must be true or false (given: 1)"),
        ({"name": 1}, "f.name: must be text (given: 1)"),
        ({"pair": 0.5}, "f.pair: must be a list (given: 0.5)"),
        ({"pair": []}, "f.pair: must have 2 entries (given: [])"),
        ({"pair": [1]}, "f.pair: must have 2 entries (given: [1])"),
        ({"pair": [1, 2, 3]}, "f.pair: must have at most 2 entries (given: [1, 2, 3])"),
        ({"inner": None}, "f.inner: must be a map of keys and values (given: null)"),
        ({"inner": {"size": 580.0}}, "f.inner.size: must be above 0 and up to 10 m (given: 580.0)"),
        ({"inner": {"sise": 1.0}}, "f.inner.sise: unknown key; allowed here: size"),
        ({"angle": 45.0}, "f.angle: must be from -1 to 1 rad (given: 45.0)"),
        ({"number": float("nan")}, "f.number: must be a finite number (given: nan)"),
    ],
)
def test_one_plain_sentence_a_mistake(data, says):
    with pytest.raises(InputError) as error:
        parse_config(Thing, data, "f")
    assert str(error.value) == says


@pytest.mark.parametrize("name", ["../evil", "", "a b", "a\nb", "a\0b", "x" * 101, ".hidden", "-rf", "é"])
def test_a_name_is_safe_as_the_name_of_a_file(name):
    for data in ({"name": name}, {"by_name": {name: {}}}):
        with pytest.raises(InputError, match=r"must be 1 to 100 letters, digits, '_', '-' or '\.'"):
            parse_config(Thing, data, "f")
    assert parse_config(Thing, {"name": as_name(name)}, "f").name


def test_a_long_value_is_cut_in_a_message():
    for value in ("x" * 5000, list(range(5000)), {str(i): {"a": [i] * 99} for i in range(99)}, "a\nb"):
        assert len(shown(value)) <= 100
        assert "\n" not in shown(value)
    with pytest.raises(InputError) as error:
        parse_config(Thing, {"number": [[0.0] * 1000] * 1000}, "f")
    assert len(str(error.value)) < 150


def test_data_that_is_not_plain_is_refused():
    data: dict = {}
    data["inner"] = data
    for wrong in (data, {"inner": {1, 2}}, {"name": b"a"}):
        with pytest.raises(InputError, match="f: only plain YAML values are allowed"):
            parse_config(Thing, wrong, "f")


class Matrices(Config):
    A: tuple[tuple[tuple[float, ...], ...], ...] = Field(min_length=1)


def test_entries_that_are_wrong_deep_inside_are_no_missing_entries():
    with pytest.raises(InputError) as error:
        parse_config(Matrices, {"A": [[["a"]]]}, "f")
    assert str(error.value) == "f.A.0.0.0: must be a number (given: 'a')"


class Mixed(Config):
    phase: int | Literal["middle"] = 0
    side: int | Literal["left", "right"] | None = None
    gain: float | tuple[float, float, float] = 1.0
    part: Inner | str = ""
    parts: tuple[Inner | float, ...] = ()
    by_name: dict[str, int | Annotated[float, within(0.0, 1.0, "m")]] = {}  # noqa: RUF012
    deep: tuple[Annotated[float | tuple[int, ...], within(0.0, 1.0, "m")], ...] | bool = False


@pytest.mark.parametrize(
    ("data", "says"),
    [
        ({"phase": "top"}, "f.phase: must be a whole number or 'middle' (given: 'top')"),
        ({"phase": 1.5}, "f.phase: must be a whole number or 'middle' (given: 1.5)"),
        ({"phase": None}, "f.phase: must be a whole number or 'middle' (given: null)"),
        ({"side": []}, "f.side: must be a whole number, 'left' or 'right' or null (given: [])"),
        ({"gain": "high"}, "f.gain: must be a number or a list (given: 'high')"),
        ({"gain": [1, 2]}, "f.gain: must have 3 entries (given: [1, 2])"),
        ({"gain": [1, 2, 3, 4]}, "f.gain: must have at most 3 entries (given: [1, 2, 3, 4])"),
        ({"gain": [1, "a", 3]}, "f.gain.1: must be a number (given: 'a')"),
        ({"part": 3}, "f.part: must be a map of keys and values or text (given: 3)"),
        ({"part": {"sise": 1.0}}, "f.part.sise: unknown key; allowed here: size"),
        ({"parts": [1, "a"]}, "f.parts.1: must be a map of keys and values or a number (given: 'a')"),
        ({"parts": [{"size": -1}]}, "f.parts.0.size: must be above 0 and up to 10 m (given: -1)"),
        ({"by_name": {"a": 2.5}}, "f.by_name.a: must be from 0 to 1 m (given: 2.5)"),
        ({"by_name": {"a": "b"}}, "f.by_name.a: must be a whole number or a number (given: 'b')"),
        ({"deep": [0.5, [1, 2.5]]}, "f.deep.1.1: must be a whole number (given: 2.5)"),
        ({"deep": ["a"]}, "f.deep.0: must be a number or a list (given: 'a')"),
        (
            {"phase": "top", "gain": "high"},
            "f.phase: must be a whole number or 'middle' (given: 'top'); "
            "f.gain: must be a number or a list (given: 'high')",
        ),
    ],
)
def test_one_sentence_a_key_names_all_alternatives_of_a_value(data, says):
    with pytest.raises(InputError) as error:
        parse_config(Mixed, data, "f")
    assert str(error.value) == says
