"""What is proved before any search is so, with numbers that sampling and Coal agree with; what has a layout is kept."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TypedDict, Unpack

import numpy as np
import pytest

from bench.draws.cells import real_cell
from duocell.models.base.pose import transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Coupling, Direction, Distance, Mirror, Rail, Rigid, SameHeight
from duocell.models.cell.floor import Floor, Footprint
from duocell.models.cell.surroundings import Clearances, Equipment, PairClass, Part, Surroundings
from duocell.models.cell.task import Task
from duocell.models.collision.collision import CollisionModel
from duocell.models.geometry.separation import separation
from duocell.models.geometry.shapes import Body, Box
from duocell.models.kinematics.link_frames import link_frames
from duocell.models.robot.arm import Interval
from duocell.optimizer.infeasibility.immediate import fixed_bodies
from duocell.optimizer.infeasibility.immediate.coupling_conflicts import coupling_conflicts
from duocell.optimizer.infeasibility.immediate.distance_conflicts import distance_conflicts
from duocell.optimizer.infeasibility.immediate.fixed_bodies import fixed_body_conflicts
from duocell.optimizer.infeasibility.immediate.immediate import immediate_infeasibility, refused
from duocell.optimizer.infeasibility.immediate.self_distances import largest_distance
from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.layout import Outcome
from tests.support.given.arms import make_arm, region
from tests.support.given.fields import CellFields
from tests.support.present import present

HOLD = Task(np.tile(transform(np.diag([1.0, -1.0, -1.0]), [0.0, 0.0, 0.5]), (2, 1, 1)))
TABLE = Body("conveyor", transform(np.eye(3), [0.0, 0.0, 0.2]), Box(np.array([1.0, 1.0, 0.4])))


class BodiesAround(TypedDict, total=False):
    """Of `Surroundings`, without the clearances."""

    obstacles: tuple[Body, ...]
    part: Part | None
    floor: Floor | None
    equipment: Mapping[str, Equipment]


def held(name: str, clearances: Clearances, **around: Unpack[BodiesAround]) -> Cell:
    """One arm that holds an object still half a metre up."""
    arm = make_arm(name, "arm", base=region((-3, 3), (-3, 3), (0, 0)))
    return Cell(HOLD, (arm,), surroundings=Surroundings(clearances=clearances, **around))


@pytest.mark.parametrize(("gap", "kept"), [(0.02, True), (0.02 - 5e-7, True), (0.0199, False)])
def test_a_part_at_exactly_the_distance_asked_for_is_kept(gap: float, kept: bool) -> None:
    part = Part((Body("part", transform(np.eye(3), [0.0, 0.0, -0.05 + gap]), Box(np.array([0.1, 0.1, 0.1]))),))
    # The object's frame is upside down half a metre up: the part's lower side is at 0.5 - gap + 0.05 - 0.05.
    lower = replace(TABLE, pose=transform(np.eye(3), [0.0, 0.0, 0.3 - 2.0 * gap]))
    cell = held("ur5e", Clearances(part_obstacle=0.02), part=part, obstacles=(lower,))
    causes = immediate_infeasibility(cell)
    assert (not causes) == kept
    for cause in causes:
        assert (cause.kind, cause.pair_class) == ("collision", PairClass.PART_OBSTACLE)
        assert cause.bodies == ("part", "conveyor")
        assert cause.possible == pytest.approx(gap, abs=1.01e-4)
        assert present(cause.possible) <= gap + 1e-6
        assert "conveyor" in cause.detail


@pytest.mark.parametrize(("name", "asked"), [("ur10e", 0.016), ("iiwa7", 0.05), ("ur10e", 0.013)])
def test_links_that_no_joint_angles_keep_apart_are_told_with_what_is_possible(name: str, asked: float) -> None:
    cell = held(name, Clearances(self_collision=asked))
    causes = immediate_infeasibility(cell)
    arm, model = cell.arms[0], CollisionModel(cell.arms, cell.surroundings)
    b, rng = model.bodies, np.random.default_rng(1)
    postures = link_frames(arm.robot, rng.uniform(-np.pi, np.pi, (150, arm.dof)).clip(arm.lower, arm.upper))
    for pair in range(len(b.first)):
        i, j = sorted((b.first[pair], b.second[pair]), key=lambda k: b.owners[k].link)
        links = b.owners[i].link, b.owners[j].link
        if links[1] - links[0] != 2:
            continue
        largest = largest_distance(arm, (links[0], b.bodies[i]), (links[1], b.bodies[j]), np.inf)
        seen = [
            separation(
                b.bodies[i].shape, f[links[0]] @ b.bodies[i].pose, b.bodies[j].shape, f[links[1]] @ b.bodies[j].pose
            ).distance
            for f in postures
        ]
        assert largest.found - 1e-9 <= largest.bound
        assert max(seen) <= largest.bound + 1e-6
        told = [cause for cause in causes if cause.bodies == (b.names[i], b.names[j])]
        assert bool(told) == (largest.bound < asked - 3e-6)
        for cause in told:
            assert cause.possible == pytest.approx(largest.found, abs=1.01e-4)
    assert bool(causes) == (asked != 0.013)


@pytest.mark.parametrize("seed", [0, 2, 4, 5, 6, 8, 10, 12, 24, 33, 38, 39])
def test_of_random_cells_only_those_without_a_layout_are_refused(seed: int) -> None:
    made = real_cell(seed)
    causes = immediate_infeasibility(made.cell)
    assert bool(causes) == (made.kind == "blocked")


@pytest.mark.parametrize(
    ("seed", "kind"), [(3, "collision"), (13, "floor"), (23, "out_of_reach"), (43, "collision"), (83, "collision")]
)
def test_blocked_cells_are_refused_without_a_search_and_say_why(seed: int, kind: str) -> None:
    answer = optimize(real_cell(seed).cell)
    assert answer.outcome is Outcome.INFEASIBLE
    assert answer.search.candidates == 0
    assert kind in {reason.kind for reason in answer.reasons}


def pair(**around: Unpack[CellFields]) -> Cell:
    """Two arms that may stand on either side of what they hold."""
    arms = (
        make_arm("ur5e", "left", base=region((-0.6, -0.3), (-0.4, 0.4), (0.0, 0.2))),
        make_arm("ur5e", "right", base=region((0.3, 0.6), (-0.4, 0.4), (0.1, 0.3))),
    )
    return Cell(HOLD, arms, **around)


def stand(x: float, y: float, z: float = 0.0, yaw: float = 0.0, arms: tuple[int, int] = (0, 1)) -> Rigid:
    return Rigid(arms, *(Interval(value, value) for value in (x, y, z, yaw)))


@pytest.mark.parametrize(
    ("couplings", "words"),
    [
        ((Distance((0, 1), 1.7, 2.0),), "ask for 1.442 m"),
        ((Distance((0, 1), 0.0, 0.5),), "ask for 0.6 m"),
        ((Distance((0, 1), 1.1, 2.0), Distance((0, 1), 0.0, 1.0)), "at least 1.1 m, but coupling 1 leave 1 m"),
        ((Direction((0, 1), 0.0), Distance((1, 0), 1.21)), "direction (coupling 0) and distance (coupling 1)"),
        ((Direction((1, 0), np.pi), Distance((1, 0), 1.21)), "direction (coupling 0) and distance (coupling 1)"),
        ((Direction((0, 1), np.pi / 2),), "direction"),
        ((Rail((0, 1), 0.0, (0.0, 1.0)),), "rail"),
        ((Mirror((0, 1), (0.0, 0.9), 0.0),), "mirror"),
        ((SameHeight((0, 1)), Direction((0, 1), np.pi)), "direction"),
        ((stand(1.6, 0.0),), "rigid asks for a minimum of 1.6 m"),
        ((stand(0.6, 0.0, z=0.4),), "rigid (coupling 0) cannot be kept"),
        ((stand(0.8, 0.0), Distance((0, 1), 1.0)), "at least 1 m, but coupling 0 leave 0.8 m"),
        ((stand(0.8, 0.0), stand(0.8, 0.0, yaw=1.0)), "1.0000 rad apart"),
        ((stand(0.8, 0.0), stand(-0.8, 0.0, yaw=1.0, arms=(1, 0))), "1.0000 rad apart"),
    ],
)
def test_couplings_that_no_bases_keep_are_named(couplings: tuple[Coupling, ...], words: str) -> None:
    causes = immediate_infeasibility(pair(couplings=couplings))
    assert {cause.kind for cause in causes} == {"coupling"}
    assert all(set(cause.arms) == {0, 1} for cause in causes)
    assert words in causes[0].detail


@pytest.mark.parametrize("other", [Direction((0, 1), 1.57), Direction((1, 0), 0.0), Direction((0, 1), 0.001)])
def test_two_directions_are_not_kept_in_one_spot(other: Direction) -> None:
    boxes = region((-5.0, 5.0), (-5.0, 5.0))
    arms = tuple(make_arm("ur5e", name, base=boxes) for name in "ab")
    (cause,) = coupling_conflicts(Cell(HOLD, arms, couplings=(Direction((0, 1), 0.0), other)))
    assert "direction (coupling 0) and direction (coupling 1)" in cause.detail


def test_distances_contradict_each_other_along_a_chain_of_arms() -> None:
    boxes = region((-5.0, 5.0), (-5.0, 5.0))
    arms = tuple(make_arm("ur5e", name, base=boxes) for name in "abc")
    chain = (Distance((0, 1), 0.0, 0.5), Distance((2, 1), 0.0, 0.7))
    (cause,) = distance_conflicts(Cell(HOLD, arms, couplings=(*chain, Distance((2, 0), 1.3))))
    assert "coupling 0 and coupling 1 leave 1.2 m" in cause.detail or "coupling 1 and coupling 0" in cause.detail
    assert cause.pointer == "/coupling/2/minimum"
    assert cause.missing == pytest.approx(0.1)
    assert not distance_conflicts(Cell(HOLD, arms, couplings=(*chain, Distance((2, 0), 1.2))))


def test_mirrored_yaws_need_intervals_that_meet() -> None:
    cell = pair(couplings=(Mirror((0, 1), (0.0, 0.0), np.pi / 2),))
    bases = [replace(arm.base, yaw=Interval(0.1 * a, 0.1 * a + 0.2)) for a, arm in enumerate(cell.arms)]
    cell = replace(cell, arms=tuple(replace(arm, base=base) for arm, base in zip(cell.arms, bases, strict=True)))
    (cause,) = immediate_infeasibility(cell)
    assert cause.missing == pytest.approx(np.pi - 0.5)  # the yaws add up to 0.1 to 0.5 rad, not to π
    turned = replace(cell, couplings=(Mirror((0, 1), (0.0, 0.0), 0.1 + np.pi),))
    assert not [cause for cause in immediate_infeasibility(turned) if "yaws" in cause.detail]


def test_two_bases_in_one_place_of_a_stand_are_named() -> None:
    close = Cell(HOLD, tuple(make_arm("ur5e", name, base=region((-2.0, 2.0), (-2.0, 2.0))) for name in "ab"))
    (cause,) = immediate_infeasibility(replace(close, couplings=(stand(0.03, 0.0, yaw=1.0),)))
    assert (cause.kind, cause.pointer) == ("coupling", "/coupling/0")
    assert "in one place" in cause.detail
    assert cause.missing == pytest.approx(0.02)
    assert not immediate_infeasibility(replace(close, couplings=(stand(0.06, 0.0, yaw=1.0),)))


@pytest.mark.parametrize(("yaw", "kept"), [(0.0, True), (0.1, True), (np.pi, False), (1.2, False)])
def test_a_stand_whose_first_base_is_turned_away_from_the_second(yaw: float, kept: bool) -> None:
    cell = pair(couplings=(stand(0.8, 0.0, z=0.1),))
    first = replace(cell.arms[0], base=replace(cell.arms[0].base, yaw=Interval(yaw, yaw)))
    causes = immediate_infeasibility(replace(cell, arms=(first, cell.arms[1])))
    assert (not causes) == kept
    assert all("rigid (coupling 0)" in cause.detail for cause in causes)


def test_couplings_that_some_bases_keep_are_never_refused() -> None:
    rng, made = np.random.default_rng(6), pair()
    for _ in range(40):
        low, high = np.array([arm.base.bounds for arm in made.arms]).transpose(2, 0, 1)
        bases = rng.uniform(low, high)
        bases[1, 2] = bases[0, 2] = rng.uniform(0.1, 0.2)
        apart = bases[1, :2] - bases[0, :2]
        angle, far = float(np.arctan2(apart[1], apart[0])), float(np.hypot(*apart))
        ties = (
            Distance((0, 1), far, far),
            Direction((0, 1), angle),
            Rail((0, 1), angle, tuple(bases[0, :2])),
            SameHeight((0, 1)),
        )
        chosen = tuple(tie for tie in ties if rng.random() < 0.6)
        assert not immediate_infeasibility(replace(made, couplings=chosen))


def test_a_floor_without_room_tells_the_margin_that_leaves_some() -> None:
    square = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    cell = held(
        "ur5e",
        Clearances(),
        floor=Floor(square, (), 0.45),
        equipment={"arm": Equipment(footprint=Footprint.disc(0.1))},
    )
    (cause,) = immediate_infeasibility(cell)
    assert (cause.kind, cause.required) == ("floor", 0.45)
    assert cause.possible == pytest.approx(0.4, abs=1.1e-3)
    around = replace(cell.surroundings, floor=Floor(square, (), present(cause.possible)))
    assert not immediate_infeasibility(replace(cell, surroundings=around))


def test_a_refusal_has_a_reason_for_every_cause() -> None:
    cell = replace(held("ur5e", Clearances()), arms=(make_arm("ur5e", "arm", base=region((9, 9.5), (9, 9.5), (0, 0))),))
    causes = immediate_infeasibility(cell)
    answer = refused(cell, causes, 0.01)
    assert [reason.kind for reason in answer.reasons] == ["out_of_reach"]
    assert answer.reasons[0].amount == present(causes[0].missing) > 7.0
    assert not answer.placements


def test_fixed_bodies_are_the_same_in_one_look_and_in_many(monkeypatch: pytest.MonkeyPatch) -> None:
    part = Part((Body("part", transform(np.eye(3), [0.0, 0.0, -0.05]), Box(np.array([0.1, 0.1, 0.1]))),))
    poses = transform(np.diag([1.0, -1.0, -1.0]), np.column_stack([np.zeros(5), np.zeros(5), np.linspace(0.6, 0.4, 5)]))
    two = (TABLE, replace(TABLE, name="other", pose=transform(np.eye(3), [0.0, 0.0, 0.195])))
    cell = replace(held("ur5e", Clearances(part_obstacle=0.02), part=part, obstacles=two), task=Task(poses))
    model = CollisionModel(cell.arms, cell.surroundings)
    at_once = fixed_body_conflicts(cell, model)
    monkeypatch.setattr(fixed_bodies, "AT_ONCE", 1)
    one_by_one = fixed_body_conflicts(cell, model)
    assert [cause.bodies for cause in at_once] == [("part", "conveyor"), ("part", "other")]
    assert at_once == one_by_one
    assert at_once[0].poses == (4,)
    assert fixed_body_conflicts(cell, model, -np.inf) == ()  # the time is over: nothing is said
