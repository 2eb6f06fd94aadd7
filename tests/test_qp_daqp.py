"""A solve in one compiled call, through DAQP's functions in C, against the same through `daqp.Model`, bit for bit."""

from __future__ import annotations

import copy
import os
import pickle
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.solvers import MathematicalProgram
from qp_programs import random_program

from pdhocbf_drake.qp import DaqpQp, QpResult, compile_program, daqp_library
from pdhocbf_drake.qp.solvers import solve_axes

SEEDS = st.integers(0, 10_000)
SCALES = st.sampled_from([0.1, 0.5, 3.0])
"""Of θ: at a large one some programs have no solution."""


def point(seed: int, scale: float) -> np.ndarray:
    return scale * np.random.default_rng(seed).normal(size=4)


def assert_same(ours: QpResult, theirs: QpResult) -> None:
    """To the last bit, and of a failure the same one."""
    assert (ours.ok, ours.infeasible, ours.status) == (theirs.ok, theirs.infeasible, theirs.status)
    for one, other in zip(ours[1:4], theirs[1:4], strict=True):
        np.testing.assert_array_equal(one, other)


def in_steps(solver: DaqpQp, theta: np.ndarray, guess: np.ndarray | None) -> tuple[int, float, np.ndarray, np.ndarray]:
    arguments = solver.arguments(theta, guess)
    return *solver.steps.solve(*arguments), *arguments[2:]


def test_this_machine_solves_in_one_call() -> None:
    # Else the tests below would compare the fallback with itself.
    assert daqp_library.is_usable()
    assert DaqpQp(compile_program(*random_program(0))).packed is not None


@settings(max_examples=40, deadline=None)
@given(seed=SEEDS, scale=SCALES, slacks=st.booleans(), guess=st.lists(st.sampled_from([-1.0, 0.0, 1.0]), max_size=20))
def test_one_call_gives_what_the_steps_give(seed: int, scale: float, slacks: bool, guess: list[float]) -> None:
    qp = compile_program(*random_program(seed, slacks))
    start = np.resize(guess, len(qp.A)) if guess else None
    for bound_rows in ([], ["box"]):
        solver = DaqpQp(qp, bound_rows)
        for at in (point(seed, scale), point(seed + 1, scale)):
            result = solver.solve(at, start)
            flag, cost, decisions, active = in_steps(solver, at, start)
            assert result.ok == (flag > 0)
            assert solver.iterations == solver.steps.iterations
            assert result.cost == cost
            np.testing.assert_array_equal(result.decisions, decisions)
            np.testing.assert_array_equal(result.active, active)


@settings(max_examples=30, deadline=None)
@given(seed=SEEDS, scale=SCALES, shared=st.booleans())
def test_two_in_one_call_are_as_each_alone(seed: int, scale: float, shared: bool) -> None:
    first = DaqpQp(compile_program(*random_program(seed, slacks=True)), ["box"])
    second = first if shared else DaqpQp(compile_program(*random_program(seed + 1)))
    for offset in range(3):
        theta = [point(seed + offset, scale), point(seed + offset + 9, scale)]
        alone = first.solve(theta[0]), second.solve(theta[1])
        guesses = [alone[0].active, None]
        warm = first.solve(theta[0], guesses[0]), second.solve(theta[1], None)
        for ours, theirs in zip(solve_axes([first, second], theta, guesses), warm, strict=True):
            assert_same(ours, theirs)


def test_threads_share_a_solver() -> None:
    solver = DaqpQp(compile_program(*random_program(4, slacks=True)))
    points = [point(seed, 0.3) for seed in range(200)]
    alone = [solver.solve(at) for at in points]
    with ThreadPoolExecutor(4) as pool:
        for ours, theirs in zip(pool.map(solver.solve, points), alone, strict=True):
            assert_same(ours, theirs)


def test_a_forked_process_solves_and_leaves_the_parent_as_it_was() -> None:
    solver, at = DaqpQp(compile_program(*random_program(4))), point(4, 0.3)
    expected = solver.solve(at)
    child = os.fork()
    if child == 0:
        solver.solve(point(5, 0.3))
        same = np.array_equal(solver.solve(at).decisions, expected.decisions)
        del solver  # frees DAQP's memory in the child
        os._exit(0 if same else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    assert_same(solver.solve(at), expected)


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda solver: pickle.loads(pickle.dumps(solver))])
def test_a_copy_has_a_memory_of_its_own(copied: object) -> None:
    solver, at = DaqpQp(compile_program(*random_program(4)), ["box"]), point(4, 0.3)
    expected = solver.solve(at)
    other = copied(solver)  # type: ignore[operator]
    solver.solve(point(5, 0.3))
    assert_same(other.solve(at), expected)
    del solver
    assert_same(other.solve(at), expected)


def test_daqps_memory_is_freed() -> None:
    import resource

    qp, at = compile_program(*random_program(4)), point(4, 0.3)
    for _ in range(200):
        DaqpQp(qp).solve(at)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(3000):  # with 8 kB each
        DaqpQp(qp).solve(at)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 8_000  # [kB]


def test_a_program_without_rows_beyond_its_simple_bounds() -> None:
    prog = MathematicalProgram()
    w, theta = prog.NewContinuousVariables(2, "w"), prog.NewContinuousVariables(2, "theta")
    prog.AddQuadraticCost(np.eye(2), np.zeros(2), w)
    rows = np.hstack([np.eye(2), -np.eye(2)])
    prog.AddLinearConstraint(rows, np.zeros(2), np.full(2, np.inf), np.append(w, theta)).evaluator().set_description(
        "floor"
    )
    solver = DaqpQp(compile_program(prog, w, theta), ["floor"])
    np.testing.assert_allclose(solver.solve(np.array([1.0, -2.0])).decisions, [1.0, 0.0], atol=1e-12)


@pytest.mark.parametrize(
    "broken",
    [
        "daqp_library.VERSIONS = ('0.0.1',)",  # another version, whose structures may differ
        "daqp_library.daqp.__file__ = None",  # its functions are not exported
        "daqp_library.DEFAULTS = (0.5, 0.5, 3)",  # its settings lie elsewhere
        "daqp_library.FLAG += 1",  # its flag does
    ],
)
def test_where_daqp_is_another_one_a_solve_goes_in_steps(broken: str) -> None:
    code = (
        "import sys; sys.path.insert(0, 'tests')\n"
        "import numpy as np\n"
        "from pdhocbf_drake.qp import DaqpQp, compile_program, daqp_library\n"
        "from qp_programs import random_program\n"
        f"{broken}\n"
        "solver = DaqpQp(compile_program(*random_program(4)))\n"
        "assert solver.packed is None\n"
        "print(solver.solve(0.3 * np.random.default_rng(4).normal(size=4)).decisions.tobytes().hex())\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    expected = DaqpQp(compile_program(*random_program(4))).solve(point(4, 0.3)).decisions
    assert done.stdout.strip() == expected.tobytes().hex()


def test_without_compilation_a_solve_goes_in_steps() -> None:
    code = (
        "import sys; sys.path.insert(0, 'tests')\n"
        "from pdhocbf_drake.qp import DaqpQp, compile_program\n"
        "from qp_programs import random_program\n"
        "print(DaqpQp(compile_program(*random_program(4))).packed)\n"
    )
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    assert done.stdout.strip() == "None"
