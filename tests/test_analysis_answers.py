"""The answers at the head of a report are those of the metrics, and say so where something went wrong."""

from __future__ import annotations

import html
import re

import pytest
import synthetic

from pdhocbf_drake.analysis.answers import answers
from pdhocbf_drake.analysis.glossary import WORDS, words_in
from pdhocbf_drake.analysis.report import ReportedRun, metrics_of, report_html, reported
from pdhocbf_drake.estimation.sample import Notice
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.robot.locate import models_folder
from pdhocbf_drake.whole_body.reason import Reason as WholeBodyReason


def _answers(metrics, **changes):
    return {a.question: a for a in answers(metrics.model_copy(update=changes))}


@pytest.fixture(scope="module")
def metrics():
    return metrics_of(synthetic.run("biped", 4.0))


def test_a_good_run_is_good_throughout(metrics) -> None:
    found = _answers(metrics, torque_limit_hits=0, unloaded_ticks=0, joint_speed_margin_min=1.0, left_path=False)
    assert found["Did it walk?"].good
    assert found["Was it safe?"].good
    assert found["What gave way?"] == ("What gave way?", "nothing", True)


@pytest.mark.parametrize(
    ("question", "changes", "said"),
    [
        ("Did it walk?", {"ending": "fell", "fell": True}, "no: fell after 4.00 s"),
        ("Did it walk?", {"left_path": True}, "left its path"),
        ("What gave way?", {"torque_limit_hits": 3}, "torques, 3 samples at a limit"),
        ("What gave way?", {"joint_speed_margin_min": -2.7}, "a joint's speed by 2.70 rad/s"),
        ("What gave way?", {"commands_limited": 1}, "1 command granted in part"),
    ],
)
def test_what_went_wrong_is_said(metrics, question: str, changes: dict[str, object], said: str) -> None:
    answer = _answers(metrics, **changes)[question]
    assert said in answer.text
    assert answer.good is False


def test_a_broken_barrier_is_named(metrics) -> None:
    ((name, use),) = metrics.barriers.items()
    broken = use.model_copy(update={"violations": 7, "h_min": -0.05})
    answer = _answers(metrics, barriers={"kept": use, name: broken})["Was it safe?"]
    assert answer.good is False
    assert answer.text == f"no: {name} below 0 at 7 ticks; {name} h ≥ -0.0500 m/s"


def test_what_is_not_judged_is_neither_good_nor_bad(metrics) -> None:
    ((name, use),) = metrics.barriers.items()
    early = _answers(metrics, barriers={name: use.model_copy(update={"violations": None})})["Was it safe?"]
    assert (early.good, early.text) == (None, "not judged: it ended too early")
    assert _answers(metrics, barriers={})["Was it safe?"].text == "not judged: it has no barrier"


def test_they_are_the_head_of_the_page() -> None:
    page = report_html([reported(synthetic.run("van_der_pol", 3.0), None)])
    assert 0 < page.index("Did it run to its end?") < page.index("Was it safe?") < page.index("Summary")
    assert "pushed" not in page


def test_a_push_comes_before_what_it_broke() -> None:
    still = synthetic.run("vhip", 3.0)
    pushed = synthetic.pushed(still, {"time": 2.5, "force": [40, 0, 0]})
    page = report_html([ReportedRun(run, metrics_of(run), [], None) for run in (pushed, still)])
    assert 0 < page.index("yes: 4 N s forward at 2.5 s") < page.index("Was it safe?")
    row = page[page.index("Was it pushed?") :].partition("</tr>")[0]
    assert row.endswith(">no</td>")


def test_every_reason_that_a_report_may_give_is_explained() -> None:
    usual = {Reason.SOLVED, WholeBodyReason.INSIDE, Notice.NONE}
    reasons = [*Reason, *WholeBodyReason, *Notice.__members__.values()]
    shown = [reason.name or "" for reason in reasons if reason not in usual]
    assert [name for name in shown if not words_in(f"3 {name}")] == []
    assert [name.lower() for name in map(str, (r.name for r in Reason)) if name.lower() not in WORDS] == ["solved"]


def test_a_report_explains_the_words_that_it_uses_and_no_others() -> None:
    run = synthetic.run("vhip", 3.0)
    run.log["solver_status"][60:63, 5] = Reason.SOFTENED
    page = report_html([ReportedRun(run, metrics_of(run), [], None)])
    table = page.partition("What the words mean")[2].partition("</details>")[0]
    found = {html.unescape(word) for word in re.findall(r'<th scope="row">(.*?)</th>', table)}
    assert {"h", "ψ", "ZMP", "degraded", "softened", "fallback", "failure"} <= found
    assert not {"recovering", "TORQUE", "NEES", "encoder"} & found


def test_a_report_names_a_robot_that_is_not_the_packaged_one(tmp_path) -> None:
    folder = models_folder() / "biped"
    text = (folder / "biped.yaml").read_text(encoding="utf-8").replace("name: biped", "name: tall")
    text = text.replace("biped.urdf", str(folder / "biped.urdf")).replace(": ..}", f": {models_folder()}}}")
    (tmp_path / "tall.yaml").write_text(text, encoding="utf-8")
    run = synthetic.run("biped", 3.0)
    own = run._replace(scenario=run.scenario.model_copy(update={"robot": str(tmp_path / "tall.yaml")}))
    titles, rows = [], []
    for each in (run, own):
        metrics = metrics_of(each)
        page = report_html([ReportedRun(each, metrics, [], None)])
        titles += re.findall("<title>(.*?)</title>", page)
        rows.append(metrics.robot)
    assert titles == ["synthetic", "synthetic, robot tall"]
    assert rows == ["biped", "tall"]
