"""Compiled functions: what they may call, and a cache that is missing, full or damaged."""

from __future__ import annotations

import importlib
import os
import pkgutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numba
import numpy as np
import pytest
from numba.core.registry import CPUDispatcher

import pdhocbf_drake
from pdhocbf_drake import jit
from pdhocbf_drake.jit import compiled


def kernels() -> list[CPUDispatcher]:
    """All kernels of the package."""
    found = {}
    for module in pkgutil.walk_packages(pdhocbf_drake.__path__, "pdhocbf_drake."):
        for value in vars(importlib.import_module(module.name)).values():
            if isinstance(value, CPUDispatcher):
                found[id(value)] = value
    return list(found.values())


def test_kernels_are_in_files_of_their_own() -> None:
    for kernel in kernels():
        assert kernel.py_func.__module__.endswith((".kernels", "_kernels")), kernel.__name__


def test_no_kernel_calls_one_of_another_file() -> None:
    # Numba's cache of a kernel is invalidated by a change of the kernel's own file, and by no other.
    assert len(kernels()) > 15
    for kernel in kernels():
        function = kernel.py_func
        called = [function.__globals__.get(name) for name in function.__code__.co_names]
        for other in called:
            if isinstance(other, CPUDispatcher):
                assert other.py_func.__module__ == function.__module__, f"{function.__name__} calls {other.__name__}"


def test_kernels_write_into_arrays_that_they_are_given() -> None:
    # To allocate and return an array costs more than most kernels' own work, and makes numba load slowly.
    for kernel in kernels():
        assert "ndarray" not in str(kernel.py_func.__annotations__["return"]), kernel.__name__


def halved(x: np.ndarray, by: float) -> np.ndarray:
    return x / by


def test_division_by_zero_is_no_error() -> None:
    assert np.isinf(compiled(halved)(np.ones(1), 0.0)).all()


def test_without_a_cache_folder_functions_are_compiled_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []
    real = numba.njit

    def without_cache(*args: object, **options: object) -> object:
        calls.append(options)
        if options.get("cache"):
            raise RuntimeError("cannot cache function: no locator available")
        return real(*args, **options)

    monkeypatch.setattr(jit, "numba", SimpleNamespace(njit=without_cache))
    np.testing.assert_array_equal(compiled(halved)(np.ones(2), 2.0), [0.5, 0.5])
    assert [bool(options.get("cache")) for options in calls] == [True, False]


def test_a_full_disk_costs_nothing_but_the_cache(tmp_path: Path) -> None:
    # In a process of its own, since numba reads the cache folder once.
    code = (
        "import numba.core.caching as caching\n"
        "def full(*_): raise OSError(28, 'No space left on device')\n"
        "caching.IndexDataCacheFile.save = full\n"
        "import numpy as np\n"
        "from pdhocbf_drake.qp import AffineMap\n"
        "print(AffineMap(np.ones(2), np.eye(2))(np.array([1.0, 2.0])))\n"
    )
    environment = {"NUMBA_CACHE_DIR": str(tmp_path), "PATH": ""}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    assert done.stdout == "[2. 3.]\n"
    assert not list(tmp_path.rglob("*.nbc"))


def test_a_cached_kernel_is_loaded_without_the_modules_that_compile_it(tmp_path: Path) -> None:
    code = (
        "import sys, numpy as np\n"
        "from pdhocbf_drake.qp import AffineMap\n"
        "print(AffineMap(np.ones(2), np.eye(2))(np.array([1.0, 2.0])), 'numba.np.linalg' in sys.modules)\n"
    )
    environment = {"NUMBA_CACHE_DIR": str(tmp_path), "PATH": ""}
    for compiles in (True, False):
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
        assert done.stdout == f"[2. 3.] {compiles}\n"


@pytest.mark.parametrize("damaged", ["*.nbi", "*.nbc"])
@pytest.mark.parametrize("left", [b"", b"garbage\n"])
def test_a_damaged_cache_is_written_anew(tmp_path: Path, damaged: str, left: bytes) -> None:
    code = (
        "import numpy as np\n"
        "from pdhocbf_drake.qp import AffineMap\n"
        "print(AffineMap(np.ones(2), np.eye(2))(np.array([1.0, 2.0])))\n"
    )
    environment = {"NUMBA_CACHE_DIR": str(tmp_path), "PATH": ""}
    for again in range(3):
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
        assert done.stdout == "[2. 3.]\n"
        for file in tmp_path.rglob(damaged):
            if again == 0:
                file.write_bytes(left)
            assert again == 0 or file.read_bytes() != left


def test_the_robots_kernels_are_loaded_without_the_modules_that_compile_them() -> None:
    # One slice of an array in a kernel would import what compiles slices, which takes longer than all kernels.
    code = (
        "import sys\n"
        "from pdhocbf_drake.robot import Biped, InverseDynamics, WholeBodyIk\n"
        "biped = Biped.load('biped')\n"
        "q = WholeBodyIk(biped).solve(__import__('biped_cases').standing(), biped.bent_knee).q\n"
        "v, vdot = WholeBodyIk(biped).derivatives(q, q[:18], q[:18])\n"
        "InverseDynamics(biped)(q, v, vdot, 0.5)\n"
        "WholeBodyIk(biped).solve(__import__('biped_cases').standing(0.75), biped.bent_knee)\n"
        "print('numba.np.arrayobj' in sys.modules)\n"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([*sys.path, str(Path(__file__).parent)])}
    for _ in range(2):  # the first one may compile them
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    assert done.stdout == "False\n"
