"""Errors of configs: brief, in the words of YAML, with the key, the value and the limit."""

from __future__ import annotations

from typing import Annotated

import pytest

from pdhocbf_drake.config import Config, Length, Name, as_name, parse_config, shown, within
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
