"""`pdhocbf design-bound`: designs and certifies a bound from a recorded walk and writes it as YAML for a scenario."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pdhocbf_drake.arguments import add_from_time
from pdhocbf_drake.barriers import Linear
from pdhocbf_drake.config import as_name
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.files.file import write_text
from pdhocbf_drake.files.places import check_file
from pdhocbf_drake.simulation.run_folder import Run, read_run
from pdhocbf_drake.walking.barrier_config import WalkBarrierConfig, WalkBoundConfig
from pdhocbf_drake.walking.quantities import QUANTITIES

if TYPE_CHECKING:  # these load Drake, and are loaded once the arguments have been checked
    from pdhocbf_drake.studies.certify.design_file import Design
    from pdhocbf_drake.studies.certify.scenario_certificate import ScenarioCertificate


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A run, the bound's quantity, kind and margin, and the file."""
    parser.add_argument("run", type=Path, metavar="RUN", help="the run folder of a walk")
    margin = parser.add_mutually_exclusive_group(required=True)
    margin.add_argument("--margin", type=float, metavar="M", help="beyond all that was measured [its unit]")
    margin.add_argument(
        "--confidence", type=float, metavar="P",
        help="or the margin, and the mpc.robust that belongs to it, from the walk's prediction errors: the share of "
        "errors at each phase that it withstands, such as 0.999",
    )  # fmt: skip
    parser.add_argument("--kind", choices=("tabulated", "harmonic"), default="tabulated", help="otherwise tabulated")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--quantity", choices=tuple(QUANTITIES), help="the bounded quantity; otherwise forward_speed")
    which.add_argument("--axis", choices=("x", "y"), help="or the axis of a CoM velocity that is not mirrored")
    parser.add_argument("--side", choices=("upper", "lower"), default="upper", help="otherwise upper")
    parser.add_argument("--gamma", type=float, nargs="+", metavar="G", help="otherwise 0.5 for each relative degree")
    parser.add_argument("--name", default="forward_speed", help="the barrier's name; otherwise forward_speed")
    add_from_time(parser, "use the walk from this time on [s]; otherwise from the scenario's from_time")
    parser.add_argument("--out", type=Path, metavar="FILE", help="the file; otherwise ./bound-NAME.yaml")


def run(options: argparse.Namespace) -> int:
    """Designs, certifies, writes and reports; returns the exit code."""
    _check(options)
    place = options.out or Path(f"bound-{options.name}.yaml")
    check_file(place)  # before the work
    recorded = read_run(options.run)
    design = _designed(recorded, options)
    from pdhocbf_drake.studies.certify.design_file import design_text  # here, for a quick start

    write_text(place, design_text(recorded, design, options.name))
    print("\n".join([*_findings(design, options.confidence), str(place)]))
    return 0


def _check(options: argparse.Namespace) -> None:
    """Raises `InputError` for what no bound can have."""
    for rate in options.gamma or []:
        Linear(rate)  # refuses a rate outside (0, 1]
    if as_name(options.name) != options.name:
        raise InputError(f"--name must be letters, digits, '_', '-' or '.', at most 100 (given: {options.name!r})")
    margin, confidence = options.margin, options.confidence
    if margin is not None and not 0.0 <= margin < math.inf:
        raise InputError(f"--margin must be a finite number from 0 on, given {margin:g}")
    if confidence is not None and not 0.0 < confidence < 1.0:
        raise InputError(f"--confidence must be above 0 and below 1, given {confidence:g}")


def _designed(recorded: Run, options: argparse.Namespace) -> Design:
    """The bound, certified; raises `InputError` where it can't be kept, or the run has none."""
    from pdhocbf_drake.studies.certify.design import design_bound, measured_envelope, robust_bound
    from pdhocbf_drake.studies.certify.design_file import Design
    from pdhocbf_drake.studies.certify.margin import margin_for, plain, with_robust
    from pdhocbf_drake.studies.certify.prediction_errors import prediction_errors
    from pdhocbf_drake.studies.certify.scenario_certificate import certify_scenario

    keys = {"axis": options.axis, "quantity": options.quantity, "side": options.side}
    named = WalkBarrierConfig(**keys, bound=WalkBoundConfig(kind="orbit"))
    gamma = tuple(options.gamma) if options.gamma else named.gamma
    scenario, errors = recorded.scenario, None
    from_time = scenario.from_time if options.from_time is None else options.from_time
    envelope = measured_envelope(recorded, named.bounded, options.side, from_time)
    unit = envelope.quantity.unit
    if options.confidence is None:
        bound = design_bound(envelope, options.margin, options.kind, options.side)
        margin = f"{options.margin:g} {unit}"
    else:
        errors = prediction_errors(recorded, options.confidence, from_time)
        scenario = with_robust(scenario, errors.robust)
        beyond, orbit = margin_for(scenario, named.model_copy(update={"gamma": gamma}), envelope)
        bound = robust_bound(envelope, orbit, beyond, options.kind, options.side)
        margin = f"{beyond.min():.3g} to {beyond.max():.3g} {unit}"
    barrier = WalkBarrierConfig(**keys, bound=bound, gamma=gamma)
    walked = plain(scenario).model_copy(update={"barriers": {options.name: barrier}})
    found = certify_scenario(walked, disturbance=scenario.mpc.robust, search=False)
    verdict = _verdict(found, options.name, margin)
    beyond_all = (
        f"{margin} beyond all that was measured in a" if errors is None
        else f"with the margin for {100 * options.confidence:g} % of the prediction errors of a"
    )  # fmt: skip
    return Design(barrier, envelope, margin, beyond_all, verdict, errors)


def _findings(design: Design, confidence: float | None) -> list[str]:
    """What was measured, the margin, and the certificate, as lines for the terminal."""
    envelope, errors = design.envelope, design.errors
    above = f"{1000 * envelope.spread:.2f} m{envelope.quantity.unit} above the mean at most"
    spread = above if design.barrier.side == "upper" else "as measured"
    lines = [f"measured  {envelope.periods} times at every phase; {spread}"]
    if errors is not None and confidence is not None:
        (com, velocity), (far, fast) = np.multiply(1e3, (errors.widest, errors.largest))
        share = f"{100 * confidence:g} % of the prediction errors"
        lines.append(
            f"errors    up to {com:.3g} mm and {velocity:.3g} mm/s at the worst tick of a step are {share} there; "
            f"measured {far:.3g}, {fast:.3g}"
        )
        if any(errors.estimate):
            far, fast = np.multiply(1e3, errors.estimate)
            lines.append(f"estimate  off by {far:.3g} mm from the foot and {fast:.3g} mm/s likewise")
        lines.append(f"margin    {design.margin} beyond all that was measured or planned")
    return [*lines, f"certified {design.verdict}"]


def _verdict(found: ScenarioCertificate, name: str, margin: str) -> str:
    """The certificate of the bound in one line; raises `InputError` if the bound can't be kept."""
    from pdhocbf_drake.studies.certify.report import share

    certificate = found.axes[found.main_axis]
    if not certificate.bounds:  # a bound on the ZMP
        if not certificate.kept.enforceable:
            raise InputError(f"barrier {name}: no walk can go on under this limit of the ZMP; take a larger margin")
        counted = "some states can walk on for ever under it" if certificate.input_limits else "not certified"
        return f"an input limit, since the ZMP is an input of the template; {counted}"
    bound = certificate.bounds[0]
    if not certificate.unbounded.enforceable:
        without = f"no state is left at phase {certificate.unbounded.first_failing_phase}, even without a bound"
        if certificate.disturbance is None:
            raise InputError(f"barrier {name}: the walk can't go on for ever ({without})")
        com, velocity = np.multiply(1e3, np.max(certificate.disturbance.boxes, axis=0))
        raise InputError(
            f"barrier {name}: no margin withstands errors of up to {com:.3g} mm and {velocity:.3g} mm/s at every step "
            f"for ever ({without}); a lower --confidence, or a walk with smaller errors, is needed"
        )
    if not bound.kept.enforceable:
        raise InputError(
            f"barrier {name}: with a margin of {margin} it can't be kept for ever (no state is "
            f"left at phase {bound.kept.first_failing_phase}); a larger margin is needed"
        )
    if bound.rows is not None and not bound.rows.enforceable:
        raise InputError(f"barrier {name}: h >= 0 can be kept for ever, but not with these gamma; take larger ones")
    rows = "" if bound.rows is None else ", its psi rows too"
    left = share(certificate, bound.kept)
    under = "" if certificate.disturbance is None else " under these errors"
    left_of_all = f"{100 * (left or 0.0):.1f} % of the states that can walk on for ever can also keep it"
    return f"enforceable{under}{rows}; {left_of_all}"
