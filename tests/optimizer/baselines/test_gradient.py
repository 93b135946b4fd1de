import numpy as np
import pytest
from hypothesis import assume, given, reject, settings
from hypothesis import strategies as st

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse, rotation_z, transform
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.robot.posture import ALL_SIGNS, Signs
from duocell.optimizer.baselines.gradient import Followed, PostureFunction, paths_at
from tests.support.given.problems import PROBLEMS, STEP, names, near, postures
from tests.support.present import present


def _neighbours(function: PostureFunction, path: Followed) -> list[tuple[Followed, Followed]] | None:
    pairs = []
    for unit in np.eye(4):
        ahead = function.follow(path.placement + STEP * unit, path)
        behind = function.follow(path.placement - STEP * unit, path)
        if ahead is None or behind is None:
            return None
        pairs.append((ahead, behind))
    return pairs


def _path_well_inside(function: PostureFunction, placement: Floats) -> Followed:
    """Finite differences need smoothness over the step: away from stretched arms and straight wrists."""
    path = function.begin(placement)
    if path is None or path.reach.values.max() >= -0.01:
        reject()
    bend = np.abs(np.sin(path.joints[:, 4] - function.problem.form.wrist_zero)).min()
    assume(bend > 0.05)
    return path


@given(name=names, signs=postures, placement=near)
@settings(max_examples=150, deadline=None)
def test_gradient_of_e_is_that_of_finite_differences(name: str, signs: Signs, placement: Floats) -> None:
    function = PostureFunction(PROBLEMS[name], signs)
    path = _path_well_inside(function, placement)
    pairs = _neighbours(function, path)
    assert pairs is not None
    numeric = [(function.objective(a) - function.objective(b)) / (2.0 * STEP) for a, b in pairs]
    gradient = present(function.pull_back(path, function.objective_slope(path)))
    assert gradient == pytest.approx(numeric, rel=1e-4, abs=1e-4 * (1.0 + np.abs(gradient).max()))


@given(name=names, signs=postures, placement=near, seed=st.integers(0, 1000))
@settings(max_examples=60, deadline=None)
def test_any_function_of_the_joints_is_pulled_back(name: str, signs: Signs, placement: Floats, seed: int) -> None:
    function = PostureFunction(PROBLEMS[name], signs)
    path = _path_well_inside(function, placement)
    weights = np.random.default_rng(seed).normal(size=path.joints.shape)
    pairs = _neighbours(function, path)
    assert pairs is not None
    numeric = [float(np.sum(weights * (a.joints - b.joints))) / (2.0 * STEP) for a, b in pairs]
    gradient = present(function.pull_back(path, weights))
    assert gradient == pytest.approx(numeric, rel=1e-4, abs=1e-4 * (1.0 + np.abs(gradient).max()))


def test_yaw_moves_joint_one_alone() -> None:
    problem = PROBLEMS["puma560"]
    function = PostureFunction(problem, (1, -1, -1))
    path = function.begin(np.array([0.3, -0.2, 0.0, 1.0]))
    assert path is not None
    turned = function.follow(path.placement + np.array([0.0, 0.0, 0.0, 20.0]), path)
    assert turned is not None  # more than three turns, and still the same windings
    assert turned.joints[:, 0] == pytest.approx(path.joints[:, 0] - problem.sigma * 20.0)
    assert turned.joints[:, 1:] == pytest.approx(path.joints[:, 1:])


def test_followed_paths_take_the_poses_and_stay_close() -> None:
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


def test_a_path_begins_with_the_lifts_of_the_evaluator_at_that_yaw() -> None:
    problem = PROBLEMS["ur5e"]
    placement = np.array([0.1, -0.2, 0.0, 2.0])
    paths = paths_at(problem, placement)
    index = ALL_SIGNS.index((1, -1, 1))
    path = PostureFunction(problem, (1, -1, 1)).begin(placement)
    assert path is not None
    assert PostureFunction(problem, (1, -1, 1)).objective(path) == pytest.approx(paths.objective[index, 0])


def test_a_base_out_of_reach_has_no_path() -> None:
    function = PostureFunction(PROBLEMS["puma560"], (1, -1, -1))
    path = function.begin(np.array([0.3, -0.2, 0.0, 1.0]))
    assert path is not None
    assert function.begin(np.array([3.0, 3.0, 0.0, 0.0])) is None
    assert function.follow(np.array([3.0, 3.0, 0.0, 0.0]), path) is None
