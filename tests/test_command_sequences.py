"""Random commands: their limits and times, and that a seed gives them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pdhocbf_drake.config import parse_config
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.checks import check_scenario
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.campaign.plan import load_campaign, plan_runs
from pdhocbf_drake.studies.shared.command_sequences import CommandSequence, drawn_sequence, packaged_sequence

PACKAGED = "walking_commands"


def ends(low: float, high: float) -> st.SearchStrategy[tuple[float, float]]:
    return st.tuples(st.floats(low, high), st.floats(low, high)).map(lambda pair: (min(pair), max(pair)))


sequences = st.builds(
    CommandSequence,
    forward=ends(-0.5, 0.5), lateral=ends(-0.2, 0.2), turn=ends(-1.0, 1.0), hold=ends(0.1, 4.0),
    stops=st.floats(0.0, 1.0), until=st.floats(0.1, 30.0),
)  # fmt: skip


@settings(max_examples=60, deadline=None)
@given(sequences, st.integers(0, 2**31))
def test_commands_keep_to_their_ends_and_hold_as_long_as_they_must(sequence: CommandSequence, seed: int) -> None:
    drawn = sequence.drawn(np.random.default_rng(seed))
    times = [command["time"] for command in drawn]
    assert times[0] == 0.0
    assert "stop" not in drawn[0]
    assert all(time < sequence.until for time in times)
    assert sequence.until - times[-1] <= sequence.hold[1]
    for one, other in pairwise(times):
        assert sequence.hold[0] - 1e-9 <= other - one <= sequence.hold[1] + 1e-9
    for command in drawn:
        if "stop" in command:
            assert command == {"time": command["time"], "stop": True}
            continue
        wanted = (*command["velocity"], command["turn"])
        for value, (low, high) in zip(wanted, (sequence.forward, sequence.lateral, sequence.turn), strict=True):
            assert low <= value <= high


@pytest.mark.parametrize("seed", [0, 5])
def test_a_seed_gives_its_sequences_and_another_one_others(seed: int) -> None:
    data = packaged_sequence().model_dump()
    assert drawn_sequence(data, seed, 3) == drawn_sequence(data, seed, 3)
    assert drawn_sequence(data, seed, 3) != drawn_sequence(data, seed, 4)
    assert drawn_sequence(data, seed, 3) != drawn_sequence(data, seed + 1, 3)


def test_the_packaged_sequences_hold_stops_starts_and_every_direction() -> None:
    drawn = [command for draw in range(200) for command in drawn_sequence(packaged_sequence().model_dump(), 1, draw)[0]]
    walks = np.array([(*command["velocity"], command["turn"]) for command in drawn if "stop" not in command])
    assert 0.1 < 1.0 - len(walks) / len(drawn) < 0.3
    np.testing.assert_allclose(walks.min(axis=0), [-0.2, -0.12, -0.45], atol=0.01)
    np.testing.assert_allclose(walks.max(axis=0), [0.375, 0.12, 0.45], atol=0.01)


def test_the_campaign_and_the_study_draw_the_same_commands() -> None:
    config, path = load_campaign(PACKAGED, seed=7, runs=4)
    runs = plan_runs(config, path.parent)
    assert len(runs) == 4
    for run in runs:
        scenario = Scenario.from_dict(run.scenario, "run")
        check_scenario(scenario)
        commands, until = drawn_sequence(packaged_sequence().model_dump(), 7, run.run)
        expected = Scenario.from_dict({**load_scenario("walking").to_dict(), "commands": commands}, "expected")
        assert scenario.commands == expected.commands
        assert scenario.duration == until


def test_seed_and_number_of_runs_replace_those_of_the_file() -> None:
    config, _ = load_campaign(PACKAGED)
    other, _ = load_campaign(PACKAGED, seed=config.seed + 1, runs=3)
    assert (other.seed, other.size()) == (config.seed + 1, 3)
    assert config.size() == 200
    with pytest.raises(InputError, match="runs"):
        load_campaign(PACKAGED, runs=0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"turn": [0.2, 0.1]}, r"turn: the first end must not be above the second \(given: 0.2 and 0.1\)"),
        ({"hold": [0.0, 1.0]}, "hold"),
        ({"stops": 1.5}, "stops"),
        ({"until": float("nan")}, "until"),
    ],
)
def test_sequences_that_make_no_sense_are_refused(changes: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        parse_config(CommandSequence, {**packaged_sequence().model_dump(), **changes}, "sequence")
