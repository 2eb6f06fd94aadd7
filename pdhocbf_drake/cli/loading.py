"""Imports of modules that load Drake, with one sentence where a library of the system that Drake needs is missing."""

from __future__ import annotations

import importlib
import io
import platform
from contextlib import redirect_stdout
from types import ModuleType

from pdhocbf_drake.errors import PdhocbfError

_MISSING = "cannot open shared object file"  # the loader's words, after the library's name
_T64 = {"debian": 13.0, "ubuntu": 24.04}  # the first version whose GLib package has this suffix


def load(module: str) -> ModuleType:
    """The imported module.

    Raises:
        PdhocbfError: Drake cannot load a library of the system; names the packages to install.
    """
    printed = io.StringIO()  # Drake prints advice of its own, for another distribution than this one perhaps
    try:
        with redirect_stdout(printed):
            loaded = importlib.import_module(module)
    except ImportError as error:
        if _MISSING in str(error) and "pydrake" in (error.path or ""):
            raise PdhocbfError(f"Drake cannot load {str(error).partition(':')[0]}; {_cure()}") from None
        raise
    print(printed.getvalue(), end="")
    return loaded


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
