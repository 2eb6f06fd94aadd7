"""Which of the gaits that were measured without a simulation are simulated."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import chain, zip_longest

from pdhocbf_drake.studies.shared.gait_measures import GaitMeasures
from pdhocbf_drake.studies.tune.aims import BEYOND


def chosen(costs: Mapping[float, GaitMeasures], own: GaitMeasures, count: int) -> list[GaitMeasures]:
    """The best gait, the best of those whose ZMP stays as far inside its box as the own gait's, and so on in turns.

    Measured without a simulation the ZMP seems farther inside than it is where the legs swing hard, and the best gaits
    are often neighbours, which all fail then.

    Args:
        costs: of gaits other than the own one. Infinite ones are left out, and where there are others, those that ask
            too much of a joint.
        own: the gait that the search began with.
        count: how many.
    """
    finite = [cost for cost in sorted(costs) if math.isfinite(cost)]
    best = [costs[cost] for cost in finite if cost < BEYOND] or [costs[cost] for cost in finite]
    least = math.inf if own.zmp_inside is None else own.zmp_inside
    calm = [gait for gait in best if gait.zmp_inside is not None and gait.zmp_inside >= least]
    in_turns = {str(gait.values): gait for gait in chain(*zip_longest(best, calm)) if gait is not None}
    return list(in_turns.values())[:count]
