"""The words of summaries and reports, one line each."""

from __future__ import annotations

import re
from typing import Final

WORDS: Final = {
    "CoM": "centre of mass",
    "ZMP": "zero-moment point: where the ground's force on the soles acts; the robot tips where it comes to their edge",
    "its box": "the rectangle in the stance foot in which the plan keeps the ZMP, eq. (27)",
    "h": "of a barrier: how far what it bounds is within its bound; safe is h ≥ 0",
    "ψ": "ψ_0 is h, and ψ_i(k) = ψ_{i−1}(k+1) − (1 − γ_i) ψ_{i−1}(k); where ψ_m ≥ 0 at every tick, h stays ≥ 0",
    "violation": "a tick with h below 0 by more than rounding",
    "acted": "a barrier acts at a tick whose plan would be another one without it",
    "limits of the plan": "bounds that joints, legs and feet leave to the plan; at them it would like to go further",
    "solve": "a tick's optimization problem, solved",
    "daqp": "the solver of quadratic programs that is tried first",
    "clarabel": "Drake's interior-point solver",
    "projection": "the filter's own method, which takes the nearest input to the wanted one",
    "failure": "a tick whose problem, as the scenario states it, had no optimum from the first solver",
    "fallback": "a tick that goes on with the last plan, shifted by a tick, since it has no plan of its own",
    "degraded": "a tick that was not simply solved; how many there were of each of the reasons below",
    "softened": "a barrier could not be kept over the horizon: it is missed by as little as can be",
    "cross_solved": "the first solver gave up, and the second one solved the same problem",
    "relaxed": "the plan could not end as the gait asks: it does so as nearly as can be, and barriers lose their decay",
    "infeasible": "the ZMP's box and the limits of a step contradict each other: the last plan goes on",
    "not_optimal": "no solver, or no program, had an answer: the last plan goes on, or joints within their limits",
    "bad_measurement": "the measured state was no number: the predicted one took its place",
    "stale_measurement": "the measured state stood still while the robot moved: the predicted one took its place",
    "stopping": "degraded for too long: the walk comes to a stand",
    "recovering": "a push or the like was noticed: until it is over, feet may go elsewhere and the ZMP farther",
    "no_steady_plan": "the steady walk had no plan, though no disturbance was noticed: planned as if one had been",
    "late_command": "the command was no number: the last one holds on",
    "limits, tick": "the first tick at which a limit of joints or soles changed the motion, and what was done",
    "KEPT": "height, torso and swing foot give way, so that every limit is kept",
    "TORQUE": "no motion keeps a joint's limit, which is exceeded by as little as can be",
    "LOAD": "a sole would have to pull at the ground",
    "FRICTION": "more of it would be needed than there is",
    "COP": "a sole's centre of pressure would be beyond its edge",
    "TWIST": "a sole would turn on the ground",
    "JOINTS": "angles and speeds of joints leave no such motion, so that CoM and soles give way",
    "UNREACHED": "the legs don't reach what is planned",
    "RATE": "a joint would have to move faster than it can",
    "NEES": "the estimate's squared error over what it expects; 8 where it expects what it makes",
    "gyroscope": "it gave no number, or stood still: the standing leg's joints stand in for it",
    "accelerometer": "likewise",
    "encoder": "it gave no number, or stood still: the joint's target stands in for it",
    "force_torque": "it gave no number, stood still, or saw no load: the foot that is to stand counts as loaded",
    "flicker": "the load of a foot came and went: the foot that is to stand counts as loaded",
    "slip": "how far a sole moved on the ground; SLIP: a loaded foot was not where it was put, and is not used",
    "in_the_air": "no foot stood",
}
"""What a word means, in the order in which they are explained."""


def words_in(text: str) -> list[tuple[str, str]]:
    """(word, meaning) of the words that occur in a text."""
    return [(word, meaning) for word, meaning in WORDS.items() if _occurs(word, text)]


def _occurs(word: str, text: str) -> bool:
    """Whether it stands there, in singular or plural, or with an index; a word in small letters also in capitals."""
    flags = 0 if word == "h" or word.isupper() else re.IGNORECASE
    return re.search(rf"(?<!\w){re.escape(word)}s?(?:_\d)?(?!\w)", text, flags) is not None
