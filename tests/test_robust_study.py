"""`pdhocbf robust`: what robustness costs and buys on the template."""

from __future__ import annotations

import json

import pytest

from pdhocbf_drake.cli import main

COARSE = "{gait: {tick: 0.04, ticks_per_step: 10, double_support_ticks: 1}, mpc: {horizon: 20, freeze_ticks: 2}}"

ROBUST = ["robust", "vhip", "--disturbance", "0.001", "0.001"]


def test_only_robust_barriers_keep_h_and_the_certified_set_keeps_every_walk(elsewhere, capsys):
    arguments = ["robust", "vhip", "--text", COARSE, "--disturbance", "0.0004", "0.003", "--multiples", "0", "1"]
    assert main([*arguments, "--out", "r"]) == 0
    assert "P-DHOCBF in its set" in capsys.readouterr().out
    outcomes = json.loads((elsewhere / "r/robust.json").read_text())["outcomes"]
    found = {(one["multiple"], one["controller"]): one for one in outcomes}
    assert len(found) == 10
    calm, disturbed = ({name: found[multiple, name] for _, name in found} for multiple in (0.0, 1.0))
    assert calm["robust P-DHOCBF"]["speed"] == calm["P-DHOCBF"]["speed"] > disturbed["robust P-DHOCBF"]["speed"]
    assert disturbed["robust P-DHOCBF"]["nearer"] > 0.0
    assert disturbed["P-DHOCBF in its set"]["below"] == 0.0
    assert disturbed["P-DHOCBF in its set"]["fell"] == [0, 8]
    assert disturbed["robust P-DHOCBF"]["below"] == 0.0
    assert all(disturbed[name]["below"] > 0.3 for name in ("none", "DCBF", "P-DHOCBF"))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["robust", "vhip_nobarrier", "--disturbance", "0", "0.001"], "a walk with one barrier is needed, given 0"),
        (["robust", "vhip_dcbf", "--disturbance", "0", "0.001"], "compared with one of kind orbit, given orbit_peak"),
        (["robust", "vhip", "--disturbance", "0", "-0.001"], "a disturbance is 2 half-widths"),
        ([*ROBUST, "--multiples", "1", "nan"], "multiples: finite numbers from 0 on are needed (given: 1 nan)"),
        ([*ROBUST, "--multiples", "-1"], "multiples: finite numbers from 0 on are needed (given: -1)"),
        ([*ROBUST, "--multiples", "1", "1e5"], "100000 times the disturbance.disturbance"),
    ],
)
def test_what_can_not_be_compared_is_refused(elsewhere, capsys, arguments, message):
    assert main(arguments) == 1
    assert message in capsys.readouterr().err
