"""The replay in a headless browser: not blank, moving, with colours that follow h, without a network."""

from __future__ import annotations

import io
import re

import matplotlib.image
import numpy as np
import pytest
import synthetic

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.replay import replay_html
from pdhocbf_drake.analysis.replay_markers import safety_along
from pdhocbf_drake.analysis.report import report_html, reported
from pdhocbf_drake.errors import RunFolderError
from pdhocbf_drake.simulation.run_folder import Run
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate

SEEK = "t => { viewer.animator.pause(); viewer.animator.seek(t); viewer.set_dirty(); }"
PLAY = "t => { const a = viewer.animator; a.reset(); a.play(); a.mixer.update(t); a.pause(); viewer.set_dirty(); }"
SCENE = """() => {
    const seen = [];
    viewer.scene_tree.find(['drake', 'world']).object.traverse(o => {
        seen.push(...o.position, ...o.scale, ...(o.material?.color?.toArray() ?? []));
    });
    return seen;
}"""
NODE = "path => { const o = viewer.scene_tree.find(['drake', 'world', ...path]).object; return [o.position, o.scale]; }"
SEEN = """path => {
    const world = viewer.scene_tree.find(['drake', 'world']).object, q = world.quaternion;
    const place = viewer.scene_tree.find(['drake', 'world', ...path]).object.position.clone();
    world.updateMatrix();
    return [place.applyMatrix4(world.matrix), 2 * Math.atan2(q.z, q.w)];
}"""
UNDER = "box => document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2).textContent"
COLOUR = "path => viewer.scene_tree.find(['drake', 'world', ...path, '<object>']).object.material.color.toArray()"


def unsafe_run(system: str, duration: float = 6.0) -> Run:
    """The synthetic run, whose h falls to zero at its end."""
    run = synthetic.run(system, duration)
    run.log["h"][-100:] = 0.0
    return run


@pytest.fixture(scope="module")
def browser(chromium):
    playwright = pytest.importorskip("playwright.sync_api")
    with playwright.sync_playwright() as player:
        arguments = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        shown = player.chromium.launch(executable_path=chromium, args=arguments)
        yield shown
        shown.close()


class Opened:
    """A page opened from disk, with everything it asked for and complained about."""

    def __init__(self, browser, path, width: int = 480, height: int = 320) -> None:
        self.page = browser.new_page(viewport={"width": width, "height": height})
        self.requests: list[str] = []
        self.complaints: list[str] = []
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on("websocket", lambda socket: self.requests.append(socket.url))
        self.page.on("console", lambda message: message.type == "error" and self.complaints.append(message.text))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.goto(f"file://{path}")
        self.page.wait_for_timeout(800)

    def seek(self, time: float) -> np.ndarray:
        """The picture at a time of the recording, (rows, columns, 3) in [0, 1]."""
        self.page.evaluate(SEEK, time)
        self.page.wait_for_timeout(300)
        return matplotlib.image.imread(io.BytesIO(self.page.screenshot()))[:, :, :3]


@pytest.fixture(scope="module", params=["biped", "vhip", "van_der_pol"])
def opened(request, browser, tmp_path_factory):
    path = tmp_path_factory.mktemp("replay") / "replay.html"
    path.write_text(replay_html(unsafe_run(request.param)), encoding="utf-8")
    shown = Opened(browser, path)
    shown.system = request.param
    yield shown
    shown.page.close()


def test_it_asks_nothing_of_a_network(opened):
    assert [url for url in opened.requests if not url.startswith(("file:", "data:", "blob:"))] == []
    assert opened.complaints == []


def test_it_is_not_blank(opened):
    picture = opened.seek(2.0)
    shades = np.round(picture * 32) @ [1, 64, 4096]
    assert len(np.unique(shades)) > 50


def test_it_moves(opened):
    moved = np.abs(opened.seek(1.5) - opened.seek(3.3)).max(axis=2) > 0.05
    assert moved.mean() > 0.002
    still = np.abs(opened.seek(1.5) - opened.seek(1.5)).max(axis=2) > 0.05
    assert still.mean() < 0.0005


def test_markers_are_where_the_log_has_them(opened):
    run = unsafe_run(opened.system)
    opened.seek(2.0)
    name, signal, columns = {
        "van_der_pol": ("state", "oscillator_state", [0, 1]),
    }.get(opened.system, ("CoM measured", "lip_state", [0, 3]))
    place, _ = opened.page.evaluate(NODE, [name])
    assert [place["x"], place["y"]] == pytest.approx(run.log[signal][200, columns], abs=1e-6)


def test_the_strip_is_in_step_and_goes_to_where_it_is_pressed(opened):
    canvas = opened.page.locator("#strip").bounding_box()
    lines = []
    for time in (2.0, 4.0):
        strip = opened.seek(time)[round(canvas["y"]) + 8 : -24, 62:-12]
        dark = (strip.max(axis=2) < 0.25).mean(axis=0)
        lines.append(int(np.argmax(dark)))
        assert dark.max() > 0.9
    assert (lines[1] - lines[0]) / strip.shape[1] == pytest.approx(2.0 / 6.0, abs=0.01)
    opened.page.mouse.click(62 + 0.5 * strip.shape[1], canvas["y"] + 40)
    assert opened.page.evaluate("viewer.animator.time") == pytest.approx(3.0, abs=0.03)


def test_play_and_time_are_at_hand_where_there_is_room(browser, tmp_path):
    (tmp_path / "replay.html").write_text(replay_html(synthetic.run("van_der_pol", 3.0)), encoding="utf-8")
    shown = []
    for size in ((480, 320), (900, 600)):
        page = Opened(browser, tmp_path / "replay.html", *size)
        shown.append(page.page.evaluate(UNDER, page.page.get_by_text("pause", exact=True).bounding_box()))
        assert page.complaints == []
        page.page.close()
    assert shown == ["Open Controls", "pause"]


def test_h_below_zero_is_filled(browser, tmp_path):
    run = synthetic.run("vhip", 6.0)
    pictures = []
    for least in (0.01, -0.1):
        run.log["h"][300:400] = least
        path = tmp_path / "replay.html"
        path.write_text(replay_html(run), encoding="utf-8")
        pictures.append(Opened(browser, path).seek(2.0)[-150:])
    red = [(np.abs(picture - palette.rgb(palette.UNSAFE)).max(axis=2) < 0.05).mean() for picture in pictures]
    assert red[0] == 0.0 < 0.01 < red[1]


def test_a_push_is_a_band_from_its_start_to_its_end(browser, tmp_path):
    run = synthetic.pushed(synthetic.run("vhip", 6.0), {"time": 1.5, "duration": 0.3, "force": [9, 0, 0]})
    path = tmp_path / "replay.html"
    path.write_text(replay_html(run), encoding="utf-8")
    strip = Opened(browser, path).seek(4.0)[-150:-24, 62:-12]
    band = (np.abs(strip - palette.rgb(palette.PUSH)).max(axis=2) < 0.05).mean(axis=0) > 0.5
    assert np.flatnonzero(band)[[0, -1]] / strip.shape[1] == pytest.approx([1.5 / 6.0, 1.8 / 6.0], abs=0.01)


def test_the_view_follows_and_turns_with_a_walk(browser, tmp_path):
    text = "{duration: 5.0, commands: [{time: 0, velocity: [0.3, 0.0], turn: 0.6}]}"
    scenario = load_scenario("vhip_nobarrier", text)
    run = Run.of(scenario, simulate(scenario))
    path = tmp_path / "replay.html"
    path.write_text(replay_html(run), encoding="utf-8")
    shown = Opened(browser, path)
    for time in (2.0, 4.5):
        shown.seek(time)
        row, (place, turn) = round(100 * time), shown.page.evaluate(SEEN, ["CoM measured"])
        heading = run.log.element("path", "yaw")[row]
        assert abs(np.remainder(turn + heading + np.pi, 2.0 * np.pi) - np.pi) < 0.25  # less than a step turns
        assert np.hypot(place["x"], place["y"]) < 0.1
    assert heading > 1.5


def test_the_marker_is_green_while_safe_and_red_at_the_limit(opened):
    path = ["state" if opened.system == "van_der_pol" else "CoM measured"]
    for time, colour in ((3.0, palette.SAFE), (5.9, palette.UNSAFE)):
        opened.seek(time)
        red, green, _ = opened.page.evaluate(COLOUR, path)
        assert (red > green) == (colour == palette.UNSAFE)
        assert [red, green] == pytest.approx(palette.rgb(colour)[:2], abs=0.02)


def test_footholds_appear_when_they_are_taken(opened):
    if opened.system == "van_der_pol":
        pytest.skip("an oscillator has no feet")
    sizes = {}
    for time in (0.7, 5.9):
        opened.seek(time)
        sizes[time] = [opened.page.evaluate(NODE, ["footholds taken", str(n)])[1]["x"] for n in range(6)]
    assert sum(size > 0.5 for size in sizes[5.9]) == 6 > sum(size > 0.5 for size in sizes[0.7])


def test_played_over_and_over_it_shows_what_it_shows_at_that_time(opened):
    duration = opened.page.evaluate("viewer.animator.duration")
    for time in (1.0, 3.3, 5.9):
        opened.seek(time)
        sought = opened.page.evaluate(SCENE)
        for rounds in (0, 1, 4):
            opened.page.evaluate(PLAY, rounds * duration + time)
            assert opened.page.evaluate(SCENE) == pytest.approx(sought, abs=1e-4)


def test_the_report_holds_its_replay_and_asks_nothing_of_a_network(browser, tmp_path):
    run = synthetic.run("vhip", 2.0)
    path = tmp_path / "report.html"
    one = reported(run, replay_html(run))
    path.write_text(report_html([one]), encoding="utf-8")
    shown = Opened(browser, path)
    assert [url for url in shown.requests if not url.startswith(("file:", "data:", "blob:", "about:"))] == []
    assert shown.complaints == []
    frame = next(frame for frame in shown.page.frames if frame != shown.page.main_frame)
    assert frame.evaluate("typeof viewer") == "object"
    assert shown.page.locator("img").count() == len(one.pictures)
    assert shown.page.evaluate("[...document.images].every(image => image.naturalWidth > 100)")


def test_ten_seconds_stay_below_ten_megabytes():
    assert len(replay_html(synthetic.run("biped", 10.0)).encode()) < 10e6


def test_the_page_names_no_other_place():
    page = replay_html(synthetic.run("vhip", 1.0))
    assert re.findall(r'<(?:script|img|iframe)[^>]*\bsrc="(?!data:)[^"]*"|<link[^>]*href="(?!data:)[^"]*"', page) == []


def test_a_log_without_motion_is_refused():
    run = synthetic.run("vhip")
    with pytest.raises(RunFolderError, match="nothing to replay"):
        replay_html(run._replace(log=run.log.after(4.0)))


def test_safety_is_the_least_of_the_barriers():
    h = np.array([[0.1, 0.2], [0.05, 0.2], [0.1, 0.0], [0.1, -1.0], [9.0, 9.0], [0.1, 0.2]])
    run = synthetic.run("vhip")
    run = run._replace(scenario=run.scenario.model_copy(update={"from_time": 0.0}))
    two = run._replace(log=RunLog({"h": h}, np.arange(6.0)))
    assert safety_along(two) == pytest.approx([1.0, 0.5, 0.0, 0.0, 1.0, 1.0])
    assert safety_along(run._replace(log=RunLog({}, np.arange(6.0)))) is None
