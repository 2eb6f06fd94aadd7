"""Firefox on a virtual screen, driven by its own remote control, Marionette: messages `length:json` over a socket.

Without a screen Debian's Firefox draws no WebGL.
"""

from __future__ import annotations

import base64
import io
import json
import os
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np

PROGRAMS = ("firefox-esr", "firefox")
_PATIENCE = 60.0  # [s]
_PREFERENCES = """
user_pref("browser.shell.checkDefaultBrowser", false);
user_pref("datareporting.policy.dataSubmissionEnabled", false);
user_pref("webgl.force-enabled", true);
user_pref("network.dns.disabled", true);
user_pref("marionette.port", %d);
"""


def found() -> str | None:
    """The path of Firefox, if there is one, and a virtual screen for it."""
    if shutil.which("Xvfb") is None:
        return None
    return next((path for name in PROGRAMS if (path := shutil.which(name))), None)


class Firefox:
    """A Firefox that listens at a port."""

    def __init__(self, port: int) -> None:
        end = time.monotonic() + _PATIENCE
        while True:
            try:
                self._socket = socket.create_connection(("127.0.0.1", port), _PATIENCE)
                break
            except OSError:
                if time.monotonic() > end:
                    raise
                time.sleep(0.1)
        self._stream, self._count = self._socket.makefile("rb"), 0
        self._answer()
        self._do("NewSession", capabilities={})

    def open(self, path: Path) -> None:
        """Opens a file, up to the end of its loading."""
        self._do("Navigate", url=path.as_uri())

    def evaluate(self, script: str) -> Any:
        """The value of an expression in the page."""
        return self._do("ExecuteScript", script=f"return window.eval({json.dumps(script)})", args=[])["value"]

    def picture(self) -> np.ndarray:
        """What is seen of the page, (height, width, 3) in [0, 1]."""
        png = base64.b64decode(self._do("TakeScreenshot", full=False)["value"])
        return np.asarray(matplotlib.image.imread(io.BytesIO(png), format="png")[..., :3])

    def _do(self, command: str, **parameters: Any) -> Any:
        self._count += 1
        message = json.dumps([0, self._count, f"WebDriver:{command}", parameters]).encode()
        self._socket.sendall(b"%d:%s" % (len(message), message))
        _, _, error, result = self._answer()
        if error:
            raise RuntimeError(error["message"])
        return result

    def _answer(self) -> Any:
        length = b""
        while not length.endswith(b":"):
            length += self._stream.read(1)
        return json.loads(self._stream.read(int(length[:-1])))


@contextmanager
def firefox(program: str, folder: Path) -> Iterator[Firefox]:
    """A Firefox with a profile of its own in a folder, on a screen of its own."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    (folder / "user.js").write_text(_PREFERENCES % port, encoding="utf-8")
    read, write = os.pipe()
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    screen = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", "1100x900x24", "-nolisten", "tcp"], pass_fds=[write], **quiet
    )
    os.close(write)
    with open(read, encoding="ascii") as display:
        place = display.readline().strip()
    env = {**os.environ, "HOME": str(folder), "DISPLAY": f":{place}", "LIBGL_ALWAYS_SOFTWARE": "1"}
    words = [program, "--no-remote", "--marionette", "--profile", str(folder), "--window-size=1000,800"]
    process = subprocess.Popen(words, env=env, **quiet)
    try:
        yield Firefox(port)
    finally:
        for own in (process, screen):
            own.terminate()
            with suppress(subprocess.TimeoutExpired):
                own.wait(_PATIENCE)
