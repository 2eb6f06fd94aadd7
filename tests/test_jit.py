"""Machine code: what it may call, and that nothing about where it is kept ends a run."""

from __future__ import annotations

import importlib
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
    """All of the package's."""
    found = {}
    for module in pkgutil.walk_packages(pdhocbf_drake.__path__, "pdhocbf_drake."):
        for value in vars(importlib.import_module(module.name)).values():
            if isinstance(value, CPUDispatcher):
                found[id(value)] = value
    return list(found.values())


def test_no_kernel_calls_one_of_another_file() -> None:
    # What numba keeps of a kernel is stamped with the kernel's own file: changed code elsewhere would go unnoticed.
    assert len(kernels()) > 15
    for kernel in kernels():
        function = kernel.py_func
        called = [function.__globals__.get(name) for name in function.__code__.co_names]
        for other in called:
            if isinstance(other, CPUDispatcher):
                assert other.py_func.__module__ == function.__module__, f"{function.__name__} calls {other.__name__}"


def test_kernels_write_into_arrays_that_they_are_given() -> None:
    # To make one and hand it over costs more than most kernels' own work, and loads a lot of numba at the start.
    for kernel in kernels():
        assert "ndarray" not in str(kernel.py_func.__annotations__["return"]), kernel.__name__


def halved(x: np.ndarray, by: float) -> np.ndarray:
    return x / by


def test_division_by_zero_is_no_error() -> None:
    assert np.isinf(compiled(halved)(np.ones(1), 0.0)).all()


def test_without_a_place_to_keep_it_the_code_is_made_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []
    real = numba.njit

    def nowhere(*args: object, **options: object) -> object:
        asked.append(options)
        if options.get("cache"):
            raise RuntimeError("cannot cache function: no locator available")
        return real(*args, **options)

    monkeypatch.setattr(jit, "numba", SimpleNamespace(njit=nowhere))
    np.testing.assert_array_equal(compiled(halved)(np.ones(2), 2.0), [0.5, 0.5])
    assert [bool(options.get("cache")) for options in asked] == [True, False]


def test_a_disk_that_is_full_costs_nothing_but_the_copy(tmp_path: Path) -> None:
    # As a process of its own: where numba keeps things is read once.
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
    assert done.stdout == "[2. 3.]\n" and not list(tmp_path.rglob("*.nbc"))


def test_what_is_kept_is_loaded_without_what_only_its_making_needs(tmp_path: Path) -> None:
    code = (
        "import sys, numpy as np\n"
        "from pdhocbf_drake.qp import AffineMap\n"
        "print(AffineMap(np.ones(2), np.eye(2))(np.array([1.0, 2.0])), 'numba.np.linalg' in sys.modules)\n"
    )
    environment = {"NUMBA_CACHE_DIR": str(tmp_path), "PATH": ""}
    for made in (True, False):
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
        assert done.stdout == f"[2. 3.] {made}\n"


@pytest.mark.parametrize("torn", ["*.nbi", "*.nbc"])
@pytest.mark.parametrize("left", [b"", b"garbage\n"])
def test_what_is_kept_and_torn_is_made_anew(tmp_path: Path, torn: str, left: bytes) -> None:
    code = (
        "import numpy as np\n"
        "from pdhocbf_drake.qp import AffineMap\n"
        "print(AffineMap(np.ones(2), np.eye(2))(np.array([1.0, 2.0])))\n"
    )
    environment = {"NUMBA_CACHE_DIR": str(tmp_path), "PATH": ""}
    for again in range(3):
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
        assert done.stdout == "[2. 3.]\n"
        for file in tmp_path.rglob(torn):
            if again == 0:
                file.write_bytes(left)
            assert again == 0 or file.read_bytes() != left
