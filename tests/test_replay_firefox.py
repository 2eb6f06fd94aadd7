"""The replay in Firefox: scene and strip are drawn, and move with the time."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator

import firefox
import numpy as np
import pytest
import synthetic

from pdhocbf_drake.analysis.replay import replay_html
from pdhocbf_drake.analysis.replay_strip import HEIGHT


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Iterator[firefox.Firefox]:
    program = firefox.found()
    if program is None:
        if os.environ.get("PDHOCBF_REQUIRE_BROWSER"):
            pytest.fail("no Firefox and Xvfb on this machine, which was promised them")
        pytest.skip("no Firefox and Xvfb on this machine")
    folder = tmp_path_factory.mktemp("firefox")
    page = folder / "replay.html"
    page.write_text(replay_html(synthetic.run("biped", 4.0)), encoding="utf-8")
    (folder / "profile").mkdir()
    with firefox.firefox(program, folder / "profile") as browser:
        browser.open(page)
        yield browser


def at(browser: firefox.Firefox, seconds: float) -> np.ndarray:
    """The page at a time of the replay, once it has been drawn."""
    before, end = browser.picture(), time.monotonic() + 120.0
    while time.monotonic() < end:
        # Each time anew: a page that is still being loaded begins to play when it is.
        browser.evaluate(f"viewer.animator.pause(); viewer.animator.seek({seconds}); viewer.set_dirty(); 1")
        time.sleep(0.5)
        after = browser.picture()
        if np.array_equal(before, after):
            return after
        before = after
    raise AssertionError("the page does not come to rest")


def test_scene_and_strip_are_drawn_and_move(opened: firefox.Firefox) -> None:
    first, second = at(opened, 0.5), at(opened, 3.0)
    height = round(HEIGHT * len(first) / opened.evaluate("window.innerHeight"))
    for part in (slice(None, -height), slice(-height, None)):
        colours = np.unique((255 * first[part]).astype(np.uint8).reshape(-1, 3), axis=0)
        assert len(colours) > 20
        moved = (np.abs(first[part] - second[part]).max(axis=2) > 0.1).mean()
        assert 1e-3 < moved < 0.5
    assert opened.evaluate("document.querySelectorAll('script[src], link[href]').length") == 0


def test_a_place_in_the_strip_is_a_time(opened: firefox.Firefox) -> None:
    at(opened, 0.5)
    opened.evaluate("""(() => {
        const strip = document.getElementById("strip"), box = strip.getBoundingClientRect();
        const where = { clientX: box.left + 0.75 * box.width, clientY: box.top + 40, buttons: 1 };
        strip.dispatchEvent(new PointerEvent("pointerdown", where));
    })()""")
    time.sleep(0.5)
    assert opened.evaluate("viewer.animator.actions[0].time") == pytest.approx(3.0, abs=0.2)
