"""Imports of modules that load Drake, with one sentence where a library of the system that Drake needs is missing."""

from __future__ import annotations

import importlib
import io
import platform
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout, suppress
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType
from typing import Any

from pdhocbf_drake.errors import PdhocbfError

_MISSING = "cannot open shared object file"  # the loader's words, after the library's name
_T64 = {"debian": 13.0, "ubuntu": 24.04}  # the first version whose GLib package has this suffix


def load(module: str) -> ModuleType:
    """The imported module.

    Raises:
        PdhocbfError: Drake cannot load a library of the system; names the packages to install.
    """
    with _one_sentence():
        return importlib.import_module(module)


@contextmanager
def drake_on_demand() -> Iterator[None]:
    """Drake is imported, at any place inside, as `load` imports it; where nothing needs it, it is not imported."""
    finder = _Finder()
    sys.meta_path.insert(0, finder)
    try:
        yield
    finally:
        with suppress(ValueError):
            sys.meta_path.remove(finder)


@contextmanager
def _one_sentence() -> Iterator[None]:
    """The import inside prints nothing where it fails for want of a library, which an error says in one sentence."""
    printed = io.StringIO()  # Drake prints advice of its own, for another distribution than this one perhaps
    try:
        with redirect_stdout(printed):
            yield
    except ImportError as error:
        if _MISSING in str(error) and "pydrake" in (error.path or ""):
            raise PdhocbfError(f"Drake cannot load {str(error).partition(':')[0]}; {_cure()}") from None
        raise
    print(printed.getvalue(), end="")


class _Finder:
    """Finds pydrake where Python finds it, but gives it a loader of our own.

    It has the methods of `importlib.abc.MetaPathFinder`, and `_Loader` those of `Loader`: to import these takes long.
    """

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        spec: Any = PathFinder.find_spec(fullname, path) if fullname == "pydrake" else None
        if spec is not None and spec.loader is not None:
            spec.loader = _Loader(spec.loader)
        return spec


class _Loader:
    """Loads a module by another loader, which the module keeps, within `_one_sentence`."""

    def __init__(self, loader: Any) -> None:
        self._loader = loader

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        module: ModuleType | None = self._loader.create_module(spec)
        return module

    def exec_module(self, module: ModuleType) -> None:
        module.__loader__ = self._loader
        if module.__spec__ is not None:
            module.__spec__.loader = self._loader
        with _one_sentence():
            self._loader.exec_module(module)


def _cure() -> str:
    """What to install, in the words of this distribution."""
    try:
        release = platform.freedesktop_os_release()
    except OSError:
        release = {}
    name = release.get("ID", "")
    if not {"debian", "ubuntu"} & {name, *release.get("ID_LIKE", "").split()}:
        return "install the libraries libX11, libSM and GLib 2 (libX11.so.6, libSM.so.6, libglib-2.0.so.0)"
    # A derivative's own number says nothing, and its apt finds the package; Debian's coming version has no number.
    suffix = "t64" if name in _T64 and float(release.get("VERSION_ID", "inf")) >= _T64[name] else ""
    packages = f"libx11-6 libsm6 libglib2.0-0{suffix}"
    return f"on {release.get('PRETTY_NAME', name)}, install its packages: apt-get install {packages}"
