"""The answers at the head of a report are those of the metrics, and say so where something went wrong."""

from __future__ import annotations

import pytest
import synthetic

from pdhocbf_drake.analysis.answers import answers
from pdhocbf_drake.analysis.report import metrics_of, report_html, reported


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
