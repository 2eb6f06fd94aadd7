"""Clocks around the Python of every block, for the part of each in a tick's time, and around the robot's arithmetic."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from inspect import isfunction
from typing import Any

from pdhocbf_drake import systems
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.robot.drake_task_space import DrakeTaskSpace
from pdhocbf_drake.robot.task_space import TaskSpace
from pdhocbf_drake.robot.tree_task_space import TreeTaskSpace
from pdhocbf_drake.simulation import estimator as _that_of_sensors_is_loaded_by  # noqa: F401
from pdhocbf_drake.simulation import simulate as _every_block_is_loaded_by  # noqa: F401
from pdhocbf_drake.studies.bench.recording import now
from pdhocbf_drake.systems.block import Block

_CALLED_BY_DRAKE = {("context", *rest) for rest in ((), ("output",), ("values",), ("value",), ("state",))}
"""Names of the arguments of a block's functions that Drake calls."""


class BlockClock:
    """Seconds spent since `clear` in each block's own code, without the blocks that it calls.

    Attributes:
        seconds: by the block's name; "PeriodicMpc" is the solve inside "MpcController".
    """

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._inner: list[float] = []

    def clear(self) -> None:
        """Sets all to zero."""
        self.seconds.clear()

    def around(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """`function`, timed."""

        def timed(*args: Any, **kwargs: Any) -> Any:
            self._inner.append(0.0)
            start = now()
            try:
                return function(*args, **kwargs)
            finally:
                spent = now() - start
                self.seconds[name] = self.seconds.get(name, 0.0) + spent - self._inner.pop()
                if self._inner:
                    self._inner[-1] += spent

        return timed


@contextmanager
def block_clock() -> Iterator[BlockClock]:
    """Diagrams that are built inside have their blocks timed; the classes are put back afterwards."""
    blocks = [
        (block, name, block.__name__)
        for block in _kinds(Block)
        for name, function in vars(block).items()
        if block.__module__.startswith(systems.__name__) and _is_callback(function)
    ]
    with _clock_around([*blocks, (PeriodicMpc, "solve", "PeriodicMpc")]) as clock:
        yield clock


@contextmanager
def robot_clock() -> Iterator[BlockClock]:
    """Times kinematics and dynamics of the robot under the name "robot"; the classes are put back afterwards."""
    owners = (TaskSpace, TreeTaskSpace, DrakeTaskSpace)
    methods = [(owner, name) for owner in owners for name in vars(owner) if isfunction(vars(owner)[name])]
    with _clock_around([(owner, name, "robot") for owner, name in methods if name != "__init__"]) as clock:
        yield clock


@contextmanager
def _clock_around(functions: Sequence[tuple[type, str, str]]) -> Iterator[BlockClock]:
    """Times each function, given as its class, its name there, and the name to sum its seconds under."""
    clock = BlockClock()
    before = [(owner, name, vars(owner)[name]) for owner, name, _ in functions]
    try:
        for owner, name, label in functions:
            setattr(owner, name, clock.around(label, getattr(owner, name)))
        yield clock
    finally:
        for owner, name, function in before:
            setattr(owner, name, function)


def _kinds(base: type[Any]) -> Iterator[type[Any]]:
    below: list[type[Any]] = base.__subclasses__()
    for kind in below:
        yield kind
        yield from _kinds(kind)


def _is_callback(function: Any) -> bool:
    code = getattr(function, "__code__", None)
    return code is not None and code.co_varnames[1 : code.co_argcount] in _CALLED_BY_DRAKE
