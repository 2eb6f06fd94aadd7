"""The ground: its pieces as keys, heights at a place, the plant's boxes under them, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from pydrake.systems.framework import DiagramBuilder

from pdhocbf_drake.analysis.replay_ground import tops
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.ground.bodies import add_ground, against
from pdhocbf_drake.ground.terrain import Terrain
from pdhocbf_drake.simulation.checks import check_scenario
from pdhocbf_drake.simulation.limits import checked_walk
from pdhocbf_drake.simulation.scenario import Scenario

STAIRS = {"kind": "stairs", "at": 1.0, "rise": 0.05, "tread": 0.25, "count": 4}
SLOPE = {"kind": "slope", "at": 3.0, "length": 2.0, "angle_deg": 6.0, "roll_deg": 4.0}
DOWN = {"kind": "slope", "at": 5.0, "length": 1.0, "angle_deg": -8.0}
BLOCKS = {"kind": "blocks", "footsteps": [[6.3, 0.08, 0.03], [6.45, -0.08, -0.04], [6.6, 0.08, 0.0]]}
ROUGH = {"kind": "rough", "from": 7.0, "to": 8.0, "size": 0.1, "amplitude": 0.01, "seed": 3, "known": False}
BOARDS = {"kind": "boards", "from": 8.5, "to": 10.0, "length": 0.3, "amplitude": 0.02, "known": False}
PATCH = {"kind": "patch", "from": 11.0, "to": 12.0, "friction": 0.3, "known": False}
STEP = {"kind": "stairs", "at": 12.5, "rise": -0.02, "tread": 0.3, "count": 1, "known": False}
ALL = [STEP, STAIRS, SLOPE, DOWN, BLOCKS, ROUGH, BOARDS, PATCH]


def scenario(*pieces: dict, **keys: object) -> Scenario:
    return Scenario.from_dict({"ground": list(pieces), **keys}, "x.yaml")


def places(count: int = 400) -> np.ndarray:
    random = np.random.default_rng(1)
    return random.uniform([0.0, -0.9], [13.5, 0.9], (count, 2))


def test_round_trip_of_all_kinds():
    made = scenario(*ALL)
    assert Scenario.from_dict(made.to_dict(), "again.yaml") == made
    assert Scenario.model_validate_json(made.model_dump_json()) == made
    check_scenario(made)


def test_heights_add_up_along_x():
    terrain = scenario(*ALL).terrain
    rise = 4 * 0.05
    assert terrain.height(0.9, 0.3) == 0.0
    assert terrain.height(1.3, 0.0) == pytest.approx(0.10)
    assert terrain.height(2.5, 0.0) == pytest.approx(rise)
    up = math.tan(math.radians(6.0))
    assert terrain.height(4.0, 0.1) == pytest.approx(rise + up + 0.1 * math.tan(math.radians(4.0)))
    level = rise + 2.0 * up - math.tan(math.radians(8.0))
    assert terrain.height(6.31, 0.08) == pytest.approx(level + 0.03)
    assert terrain.height(6.31, -0.3) < level - 0.1
    assert terrain.height(11.5, 0.0) == pytest.approx(level)
    assert terrain.height(13.0, 0.0, known=False) == pytest.approx(level - 0.02)
    assert terrain.height(13.0, 0.0) == pytest.approx(level)


def test_normal_is_the_gradient_of_the_height():
    terrain, step = scenario(SLOPE, DOWN).terrain, 1e-6
    for x, y in ((3.5, 0.2), (5.5, -0.2), (8.0, 0.0)):
        ahead = terrain.height(x + step, y) - terrain.height(x - step, y)
        aside = terrain.height(x, y + step) - terrain.height(x, y - step)
        normal = np.array([-ahead, -aside, 2.0 * step])
        assert terrain.normal(x, y) == pytest.approx(normal / np.linalg.norm(normal), abs=1e-6)


def test_z_is_counted_from_the_start():
    from_above = scenario(STAIRS, start={"position": [2.5, 0.0]}).terrain
    assert from_above.height(2.5, 0.0) == 0.0
    assert from_above.height(0.0, 0.0) == pytest.approx(-0.2)


def test_windows_end_at_edges_alone():
    half, terrain = 0.1, scenario(STAIRS, {**PATCH, "known": True}).terrain
    assert terrain.window(1.3, 0.0, half) == pytest.approx((1.25 + half, 1.5 - half))
    low, high = terrain.window(11.5, 0.0, half)
    assert low == pytest.approx(1.75 + half)
    assert high > 1e3
    assert scenario(ROUGH).terrain.window(7.5, 0.0, half)[1] > 1e3
    tile = scenario(ROUGH).terrain.window(7.55, 0.05, half, known=False)
    assert tile[1] - tile[0] == pytest.approx(0.1 - 2 * half, abs=1e-9)


def test_each_foot_has_boards_of_its_own():
    terrain = scenario(BOARDS).terrain
    left = {terrain.height(x, 0.08, known=False) for x in np.arange(8.55, 10.0, 0.1)}
    assert len(left) == 5
    assert terrain.height(8.85, 0.08, known=False) != terrain.height(8.75, 0.08, known=False)
    assert terrain.height(8.85, -0.08, known=False) == terrain.height(8.75, -0.08, known=False)


def distances(made: Scenario, points: np.ndarray) -> tuple[np.ndarray, list[CoulombFriction]]:
    """How far each point (n, 3) is from the plant's ground, and the friction that it meets there."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.001)
    add_ground(plant, made.terrain, made.friction)
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    query = scene_graph.get_query_output_port().Eval(scene_graph.GetMyContextFromRoot(context))
    inspector = scene_graph.model_inspector()
    found, frictions = [], []
    for point in points:
        near = min(query.ComputeSignedDistanceToPoint(point), key=lambda one: one.distance)
        found.append(near.distance)
        frictions.append(inspector.GetProximityProperties(near.id_G).GetProperty("material", "coulomb_friction"))
    return np.array(found), frictions


def test_the_boxes_of_the_plant_are_the_ground():
    made = scenario(*ALL)
    terrain, flat = made.terrain, places()
    tops = np.array([[x, y, terrain.height(x, y, known=False)] for x, y in flat])
    over = np.array([0.0, 0.0, 1e-3])
    above, _ = distances(made, tops + over)
    below, _ = distances(made, tops - over)
    assert (above > 0.5e-3).mean() > 0.97  # beside a wall a point over the ground is nearer to that
    assert (above > 0.0).all()
    assert (below < 0.0).all()


def test_soles_meet_the_friction_of_a_patch():
    made = scenario(PATCH, friction=0.8)
    _, found = distances(made, np.array([[11.5, 0.0, 1e-3], [10.5, 0.0, 1e-3]]))
    met = [2 * own.static_friction() * 0.8 / (own.static_friction() + 0.8) for own in found]
    assert met == pytest.approx([0.3, 0.8])
    assert [made.terrain.friction(x, 0.0) for x in (11.5, 10.5)] == [0.3, 0.8]
    assert against(0.5, 0.5) == pytest.approx(0.5)


def test_what_is_drawn_is_the_ground():
    terrain = scenario(*ALL).terrain
    drawn = tops(terrain, (0.0, 13.0), (-1.0, 1.0))
    for name in ("light", "dark"):
        vertices, faces = drawn[name].mesh()
        middles = vertices[:, faces].mean(axis=1).T
        over = [z - terrain.height(x, y, known=False) for x, y, z in middles]
        hidden = np.array(over) < -0.02  # the pit's floor below blocks
        assert np.array(over)[~hidden] == pytest.approx(-0.002, abs=1e-9)
        assert hidden.mean() < 0.05
    assert tops(Terrain(), (0.0, 1.0), (0.0, 1.0))["walls"].mesh() is None


@pytest.mark.parametrize(
    ("piece", "said"),
    [
        ({**STAIRS, "tread": 0.0}, "ground.0.tread: must be above 0"),
        ({**STAIRS, "count": 0}, "ground.0.count: must be at least 1"),
        ({**STAIRS, "rise": 0.0}, "rise must not be 0"),
        ({**STAIRS, "at": math.nan}, "ground.0.at: must be a finite number"),
        ({**STAIRS, "length": 1.0}, "length: unknown key; allowed here: at, count, friction, kind, known, rise, tread"),
        ({**STAIRS, "kind": "stair"}, "'kind' must be one of 'stairs', 'slope', 'blocks'"),
        ({"at": 1.0}, "'kind' is needed, but missing"),
        ({**PATCH, "to": 11.0}, "to must be above from, 11 m"),
        ({**PATCH, "friction": None}, "ground.0.friction: must be a number"),
        ({**ROUGH, "start": 1.0}, "start: unknown key; allowed here: amplitude, friction, from, kind"),
        ({**ROUGH, "size": 0.02, "to": 90.0}, "parts are too many: 10000 at most"),
        ({**BLOCKS, "footsteps": [[6.3, 0.08, 0.0], [6.4, 0.0, 0.0]]}, "the blocks of footsteps 0 and 1 overlap"),
        ({**SLOPE, "angle_deg": 40.0}, "soles slide down a slope of 40.1° at a friction of 0.8"),
        ({**SLOPE, "friction": 0.1}, "soles slide down a slope of 7.2° at a friction of 0.1"),
        ({**PATCH, "friction": 1.6}, "ground.0.friction: must be below twice that of the soles, 0.8 (given: 1.6)"),
    ],
)
def test_refused(piece: dict, said: str):
    with pytest.raises(InputError) as error:
        check_scenario(scenario(piece))
    assert said in str(error.value)


def test_two_pieces_at_one_place_are_refused():
    with pytest.raises(InputError, match=r"ground: the stairs from 1 to 2 m and the slope from 1.9 m on are at one"):
        scenario(STAIRS, {**SLOPE, "at": 1.9})
    scenario(STAIRS, {**SLOPE, "at": 2.0})


def test_ground_that_goes_too_far_is_refused():
    with pytest.raises(InputError, match=r"ground: the stairs must end at x = 1000 m at most \(given: 1801\)"):
        scenario({**STAIRS, "tread": 2.0, "count": 900})


@pytest.mark.parametrize("at", [0.05, -0.05, 0.0])
def test_a_start_on_an_edge_is_refused(at: float):
    with pytest.raises(InputError, match=r"sole at x = 0\.00 m must lie wholly on level ground"):
        checked_walk(scenario({**STAIRS, "at": at}))
