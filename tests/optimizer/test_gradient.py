import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from models.arm import Arm, BaseRegion, Interval, range_weights
from models.catalogue import robot
from models.cell import Cell
from models.kinematics import flange_poses
from models.pose import inverse, rotation_z, transform
from models.posture import ALL_SIGNS
from models.task import line
from optimizer.gradient import Followed, PostureFunction, paths_at
from optimizer.reduced import ReducedProblem, reduced_problem

STEP = 1e-6


def _problem(name: str) -> ReducedProblem:
    """A tilted line of 30 cm in front of the origin, for any arm of about a metre."""
    chain = robot(name)
    start = transform(rotation_z(0.3), np.array([0.5, 0.1, 0.1]))
    end = transform(rotation_z(-0.4), np.array([0.6, 0.35, 0.2]))
    grasp = transform(np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), np.array([-0.06, -0.01, -0.02]))
    side = Interval(-2.0, 2.0)
    arm = Arm(
        name,
        chain,
        np.eye(4),
        grasp,
        BaseRegion(side, side, side),
        chain.lower,
        chain.upper,
        chain.reference + 0.1,
        range_weights(chain.lower, chain.upper),
    )
    problem = reduced_problem(Cell(line(start, end, 6), (arm,)), arm)
    assert problem is not None
    return problem


PROBLEMS = {name: _problem(name) for name in ("puma560", "ur5e", "gp8")}


def _around(distance: float, bearing: float, z: float, yaw: float) -> np.ndarray:
    """A base on a ring about the path."""
    return np.array([0.55 + distance * np.cos(bearing), 0.22 + distance * np.sin(bearing), z, yaw])


near = st.builds(_around, st.floats(0.3, 0.55), st.floats(-3.2, 3.2), st.floats(-0.1, 0.2), st.floats(-3.0, 3.0))
anywhere = st.builds(_around, st.floats(0.0, 2.0), st.floats(-3.2, 3.2), st.floats(-1.0, 1.0), st.just(0.0))
names = st.sampled_from(sorted(PROBLEMS))
postures = st.sampled_from(ALL_SIGNS)


def _neighbours(function: PostureFunction, path: Followed) -> list[tuple[Followed, Followed]] | None:
    pairs = []
    for unit in np.eye(4):
        ahead = function.follow(path.placement + STEP * unit, path)
        behind = function.follow(path.placement - STEP * unit, path)
        if ahead is None or behind is None:
            return None
        pairs.append((ahead, behind))
    return pairs


def _well_inside(function: PostureFunction, path: Followed) -> bool:
    """Finite differences need smoothness over the step: away from stretched arms and straight wrists."""
    bend = np.abs(np.sin(path.joints[:, 4] - function.problem.form.wrist_zero)).min()
    return bool(path.reach.values.max() < -0.01 and bend > 0.05)


@given(name=names, signs=postures, placement=near)
@settings(max_examples=150, deadline=None)
def test_gradient_of_e_is_that_of_finite_differences(name, signs, placement):
    function = PostureFunction(PROBLEMS[name], signs)
    path = function.begin(placement)
    assume(path is not None and _well_inside(function, path))
    pairs = _neighbours(function, path)
    assert pairs is not None
    numeric = [(function.objective(a) - function.objective(b)) / (2.0 * STEP) for a, b in pairs]
    gradient = function.pull_back(path, function.objective_slope(path))
    assert gradient == pytest.approx(numeric, rel=1e-4, abs=1e-4 * (1.0 + np.abs(gradient).max()))


@given(name=names, signs=postures, placement=near, seed=st.integers(0, 1000))
@settings(max_examples=60, deadline=None)
def test_any_function_of_the_joints_is_pulled_back(name, signs, placement, seed):
    function = PostureFunction(PROBLEMS[name], signs)
    path = function.begin(placement)
    assume(path is not None and _well_inside(function, path))
    weights = np.random.default_rng(seed).normal(size=path.joints.shape)
    pairs = _neighbours(function, path)
    assert pairs is not None
    numeric = [float(np.sum(weights * (a.joints - b.joints))) / (2.0 * STEP) for a, b in pairs]
    gradient = function.pull_back(path, weights)
    assert gradient == pytest.approx(numeric, rel=1e-4, abs=1e-4 * (1.0 + np.abs(gradient).max()))


@given(name=names, signs=postures, placement=anywhere)
@settings(max_examples=100, deadline=None)
def test_reach_rows_have_the_gradient_of_finite_differences_inside_and_outside(name, signs, placement):
    function = PostureFunction(PROBLEMS[name], signs)
    rows = function.reach_at(placement[:3])
    shifted = [
        (function.reach_at(placement[:3] + STEP * unit).values, function.reach_at(placement[:3] - STEP * unit).values)
        for unit in np.eye(3)
    ]
    numeric = np.stack([(a - b) / (2.0 * STEP) for a, b in shifted], axis=-1)
    smooth = np.abs(rows.values[2]) > 1e-3  # at the edge of the cylinder about axis 1 the triangle appears
    if function.problem.form.kind == "three-parallel":
        fifth = function._branch(np.array([*placement[:3], 0.0]))[0][:, 4]
        smooth &= np.abs(np.sin(fifth - function.problem.form.wrist_zero)) > 0.05
    assert rows.gradients[:, smooth] == pytest.approx(numeric[:, smooth], abs=1e-4)


@given(name=names, signs=postures, placement=anywhere)
@settings(max_examples=60, deadline=None)
def test_reach_rows_are_violated_exactly_where_branches_are_missing(name, signs, placement):
    function = PostureFunction(PROBLEMS[name], signs)
    missing = function._branch(np.array([*placement[:3], 0.0]))[1]
    worst = np.maximum(function.reach_at(placement[:3]).values.max(axis=0), 0.0)
    assert ((worst > 1e-9) == (missing > 1e-9)).all()
    assert (worst <= missing + 1e-9).all()  # what is missing adds the rows up


def test_yaw_moves_joint_one_alone():
    problem = PROBLEMS["puma560"]
    function = PostureFunction(problem, (1, -1, -1))
    path = function.begin(np.array([0.3, -0.2, 0.0, 1.0]))
    assert path is not None
    turned = function.follow(path.placement + np.array([0.0, 0.0, 0.0, 20.0]), path)
    assert turned is not None  # more than three turns, and still the same lifts
    assert turned.joints[:, 0] == pytest.approx(path.joints[:, 0] - problem.sigma * 20.0)
    assert turned.joints[:, 1:] == pytest.approx(path.joints[:, 1:])


def test_followed_paths_take_the_poses_and_stay_close():
    problem = PROBLEMS["ur5e"]
    function = PostureFunction(problem, (1, -1, 1))
    path = function.begin(np.array([0.1, -0.2, 0.0, 0.4]))
    assert path is not None
    for _ in range(50):
        new = function.follow(path.placement + np.array([0.002, -0.002, 0.001, 0.05]), path)
        assert new is not None
        assert np.abs(new.joints - path.joints).max() < 0.3
        path = new
    x, y, z, yaw = path.placement
    base = transform(rotation_z(yaw), np.array([x, y, z]))
    wanted = inverse(base) @ transform(problem.rotations, problem.positions)
    assert flange_poses(problem.arm.robot, path.joints) == pytest.approx(wanted, abs=1e-9)


def test_a_path_begins_with_the_lifts_of_the_evaluator_at_that_yaw():
    problem = PROBLEMS["ur5e"]
    placement = np.array([0.1, -0.2, 0.0, 2.0])
    paths = paths_at(problem, placement)
    index = ALL_SIGNS.index((1, -1, 1))
    path = PostureFunction(problem, (1, -1, 1)).begin(placement)
    assert path is not None
    assert PostureFunction(problem, (1, -1, 1)).objective(path) == pytest.approx(paths.objective[index, 0])


def test_a_base_out_of_reach_has_no_path():
    function = PostureFunction(PROBLEMS["puma560"], (1, -1, -1))
    path = function.begin(np.array([0.3, -0.2, 0.0, 1.0]))
    assert path is not None
    assert function.begin(np.array([3.0, 3.0, 0.0, 0.0])) is None
    assert function.follow(np.array([3.0, 3.0, 0.0, 0.0]), path) is None
