"""Makes the moving picture of the README: `python docs/movie.py` writes walk.gif beside this file.

It walks `walking` through a turn and a push, opens the replay in headless Chromium (needs playwright and Chromium), and
takes a picture every 80 ms.
"""

from __future__ import annotations

import io
import shutil
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

from pdhocbf_drake import load_scenario, replay, simulate, write_run

HERE = Path(__file__).parent
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
WALK = """
duration: 8.0
commands:
  - {time: 0.0, velocity: [0.3, 0.0]}
  - {time: 2.4, velocity: [0.3, 0.0], turn: 0.6}
  - {time: 5.0, velocity: [0.3, 0.0]}
pushes: [{time: 5.7, duration: 0.1, force: [0.0, 60.0, 0.0]}]
"""
START, END, EVERY = 2.0, 7.6, 0.08  # [s]
SIZE = {"width": 720, "height": 560}
COLOURS = 255
SEEK = "t => { viewer.animator.pause(); viewer.animator.seek(t); viewer.set_dirty(); }"
HIDE = "() => document.querySelectorAll('.dg, .lil-gui, #legend').forEach(part => part.style.display = 'none')"


def main() -> None:
    """Writes walk.gif."""
    scenario = load_scenario("walking", WALK)
    with tempfile.TemporaryDirectory() as folder:
        run = write_run(Path(folder) / "walk", simulate(scenario), scenario)
        page = Path(folder) / "replay.html"
        replay(run, page)
        pictures = frames(page)
    first, *others = (
        picture.quantize(COLOURS, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE) for picture in pictures
    )
    milliseconds = round(1e3 * EVERY)
    first.save(HERE / "walk.gif", save_all=True, append_images=others, duration=milliseconds, loop=0, optimize=True)


def frames(replay_page: Path) -> list[Image.Image]:
    """The pictures of a replay, from `START` to before `END`."""
    browser_path = next(filter(None, map(shutil.which, BROWSERS)))
    with sync_playwright() as player:
        arguments = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        browser = player.chromium.launch(executable_path=browser_path, args=arguments)
        page = browser.new_page(viewport=SIZE)
        page.goto(f"file://{replay_page}")
        page.wait_for_timeout(2000)
        page.evaluate(HIDE)
        pictures = []
        for picture in range(round((END - START) / EVERY)):
            page.evaluate(SEEK, START + picture * EVERY)
            page.wait_for_timeout(400)
            pictures.append(Image.open(io.BytesIO(page.screenshot())).convert("RGB"))
        browser.close()
    return pictures


if __name__ == "__main__":
    main()
