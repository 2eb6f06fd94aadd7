"""DAQP's functions in C: called by compiled code, a solve needs no Python.

The package `daqp` exports them, but promises neither their names nor the structures that they read. They are used only
where the installed version is one whose structures are written down here, and where a small program has the same
answer through them as through `daqp.Model`.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
from llvmlite.binding import add_symbol
from numba import config

from pdhocbf_drake.qp.kernels import NEW_LIMITS_AND_SENSES

try:
    import daqp
except ImportError:
    daqp = None


def has_daqp() -> bool:
    """Whether the package `daqp` is installed."""
    return daqp is not None


VERSIONS = ("0.11.0",)
"""Versions of `daqp` whose structures are as below."""

SETTINGS = {"primal_tol": 1e-10, "dual_tol": 1e-10, "iter_limit": 2000}

# C structures in words of four bytes.
WORDS = 36
"""Length of DAQPProblem and DAQPResult together."""
RESULT = 20
"""Where DAQPResult begins, behind DAQPProblem."""
FLAG, ITERATIONS = RESULT + 8, RESULT + 9
_SECONDS = (RESULT + 12) // 2  # in words of eight bytes
_H, _A, _UPPER, _LOWER, _SENSE, _Y, _MULTIPLIERS = 2, 4, 5, 6, 7, RESULT // 2, RESULT // 2 + 1  # likewise: pointers
_PRIMAL_TOL, _DUAL_TOL, _ITERATION_LIMIT = 0, 1, 11  # of DAQPSettings; the last one in words of four bytes
DEFAULTS = 1e-6, 1e-12, 10_000
_SIZE = 4096  # of DAQPWorkspace [bytes]; less than 500 are used


class Workspace:
    """DAQP's memory for one program min ½ yᵀH y, lower ≤ [y; R y] ≤ upper, as many simple bounds as there is room for.

    It reads and writes arrays that the caller keeps: limits and senses before a solve, y and multipliers after it.

    Attributes:
        flag: of the set-up, negative where DAQP refuses the program.
        addresses: of DAQPWorkspace, DAQPProblem and DAQPResult.

    Args:
        words: where problem and result are written, (`WORDS`,), at an address that is a multiple of 8.
        hessian, rows: H (n, n), R.
        upper, lower: limits, (m,). senses: DAQP's, (m,).
        y, multipliers: (n,), (m,).
    """

    def __init__(
        self, words: np.ndarray, hessian: np.ndarray, rows: np.ndarray, upper: np.ndarray, lower: np.ndarray,
        senses: np.ndarray, y: np.ndarray, multipliers: np.ndarray,
    ) -> None:  # fmt: skip
        self._functions = functions = _functions()
        rows = np.ascontiguousarray(rows)
        words[:3] = len(hessian), len(upper), len(upper) - len(rows)
        pointers = words.view(np.int64)
        for place, array in (
            (_H, hessian), (_A, rows), (_UPPER, upper), (_LOWER, lower), (_SENSE, senses), (_Y, y),
            (_MULTIPLIERS, multipliers),
        ):  # fmt: skip
            pointers[place] = array.ctypes.data if array.size else 0
        self._words, self._seconds = words, words.view(np.float64)[_SECONDS:]
        self._kept = hessian, rows, upper, lower, senses, y, multipliers  # which DAQP reads and writes
        self._memory = np.zeros(_SIZE // 8, dtype=np.int64)
        problem, own = words.ctypes.data, self._memory.ctypes.data
        self.addresses = own, problem, problem + 4 * RESULT
        functions.allocate_daqp_settings(own)
        self._take_settings()
        self.flag = int(functions.setup_daqp(problem, own, None))

    def _take_settings(self) -> None:
        """Writes `SETTINGS` where DAQP has allocated its defaults: at the only address in its new memory.

        Raises:
            ValueError: what lies there are not the defaults.
        """
        (address,) = self._memory[self._memory != 0].tolist()
        numbers = (ctypes.c_double * 2).from_address(address)
        limits = (ctypes.c_int * (_ITERATION_LIMIT + 1)).from_address(address)
        if (numbers[_PRIMAL_TOL], numbers[_DUAL_TOL], limits[_ITERATION_LIMIT]) != DEFAULTS:
            raise ValueError("DAQP's settings lie elsewhere")
        numbers[_PRIMAL_TOL], numbers[_DUAL_TOL] = SETTINGS["primal_tol"], SETTINGS["dual_tol"]
        limits[_ITERATION_LIMIT] = int(SETTINGS["iter_limit"])

    def soften(self, rho: np.ndarray, linear: np.ndarray) -> None:
        """Prices violations of soft rows, linear · s + s²/(2 rho) on either side, (m,) each."""
        quadratic, slope = rho.ctypes.data, linear.ctypes.data
        self._functions.daqp_set_soft_weights(self.addresses[0], quadratic, quadratic, slope, slope)

    @property
    def iterations(self) -> int:
        """Of the last solve."""
        return int(self._words[ITERATIONS])

    @property
    def seconds(self) -> float:
        """Of the last solve, by DAQP's own clock."""
        return float(self._seconds[0])

    def __reduce__(self) -> str:
        raise TypeError("DAQP's memory can't be copied")

    def __del__(self) -> None:
        if hasattr(self, "addresses"):
            self._functions.free_daqp_workspace(self.addresses[0])
            self._functions.free_daqp_ldp(self.addresses[0])


class _Functions:
    """The functions that a workspace needs besides those that kernels call."""

    def __init__(self, library: ctypes.CDLL) -> None:
        pointer, integer = ctypes.c_void_p, ctypes.c_int

        def of(name: str, returns: Any, *takes: Any) -> Callable[..., Any]:
            function = library[name]
            function.restype, function.argtypes = returns, takes
            return function

        self.allocate_daqp_settings = of("allocate_daqp_settings", None, pointer)
        self.setup_daqp = of("setup_daqp", integer, pointer, pointer, pointer)
        self.daqp_set_soft_weights = of("daqp_set_soft_weights", integer, *[pointer] * 5)
        self.free_daqp_workspace = of("free_daqp_workspace", None, pointer)
        self.free_daqp_ldp = of("free_daqp_ldp", None, pointer)
        self.daqp_update_ldp = of("daqp_update_ldp", integer, integer, pointer, pointer)
        self.daqp_solve = of("daqp_solve", None, pointer, pointer)


@cache
def _functions() -> _Functions:
    """Those of the installed package.

    Raises:
        AttributeError: it does not export one of them.
    """
    return _Functions(ctypes.CDLL(daqp.__file__))


@cache
def is_usable() -> bool:
    """Whether kernels can call DAQP; if so, its functions are made known to them."""
    if daqp is None or config.DISABLE_JIT:  # type: ignore[attr-defined]
        return False
    try:
        if version("daqp") not in VERSIONS or not _agrees():
            return False
    except (PackageNotFoundError, OSError, AttributeError, ValueError):  # its metadata, file, functions or structures
        return False
    for name in ("daqp_update_ldp", "daqp_solve"):
        add_symbol(name, ctypes.cast(getattr(_functions(), name), ctypes.c_void_p).value)
    return True


def _agrees() -> bool:
    """Whether a program of two decisions has the same answer as through `daqp.Model`, to the last bit."""
    hessian, rows, senses = np.array([[2.0, 0.5], [0.5, 1.0]]), np.array([[1.0, -3.0]]), np.zeros(3, dtype=np.int32)
    upper, lower = np.full(3, 9.0), np.full(3, -9.0)
    words, y, multipliers = np.zeros(WORDS // 2, dtype=np.int64).view(np.int32), np.zeros(2), np.zeros(3)
    model = daqp.Model()
    model.settings = SETTINGS
    model.setup(hessian, None, rows, upper.copy(), lower.copy(), senses)
    ours = Workspace(words, hessian, rows, upper, lower, senses, y, multipliers)
    lower[:] = 0.3, -9.0, 0.7
    own, problem, result = ours.addresses
    flag = _functions().daqp_update_ldp(NEW_LIMITS_AND_SENSES, own, problem)
    _functions().daqp_solve(result, own)
    expected = model.update(bupper=upper, blower=lower, sense=senses)
    theirs, _, flag_of_theirs, info = model.solve()
    return (
        ours.flag > 0
        and flag == expected
        and (words[FLAG], words[ITERATIONS]) == (flag_of_theirs, info["iterations"])
        and bool((y == theirs).all() and (multipliers == info["lam"]).all() and multipliers.any())
    )
