import numpy as np
import pytest
from hypothesis import given, settings

from duocell.models.base.arrays import Floats
from duocell.models.catalogue.catalogue import robot
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.robot.posture import Signs
from duocell.optimizer.baselines.gradient import PostureFunction
from duocell.optimizer.baselines.reach import reach_range
from tests.support.given.arms import form_of
from tests.support.given.problems import PROBLEMS, STEP, anywhere, names, postures


@given(name=names, signs=postures, placement=anywhere)
@settings(max_examples=100, deadline=None)
def test_reach_rows_have_the_gradient_of_finite_differences_inside_and_outside(
    name: str, signs: Signs, placement: Floats
) -> None:
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
def test_reach_rows_are_violated_exactly_where_branches_are_missing(name: str, signs: Signs, placement: Floats) -> None:
    function = PostureFunction(PROBLEMS[name], signs)
    missing = function._branch(np.array([*placement[:3], 0.0]))[1]
    worst = np.maximum(function.reach_at(placement[:3]).values.max(axis=0), 0.0)
    assert ((worst > 1e-9) == (missing > 1e-9)).all()
    assert (worst <= missing + 1e-9).all()  # what is missing adds the rows up


def test_reaches_of_the_source() -> None:
    puma = robot("puma560")
    low, high = reach_range(puma, form_of(puma))
    assert low == pytest.approx(0.290, abs=1e-3)  # that of the source, corrected
    assert high == pytest.approx(0.9336, abs=2e-3)


@pytest.mark.parametrize("name", sorted(PROBLEMS))
def test_no_posture_inside_the_limits_is_outside_the_range(name: str) -> None:
    """Distances from the point where axis 1 is nearest to axis 2, the shoulder that the source measures from."""
    arm = robot(name)
    form = form_of(arm)
    low, high = reach_range(arm, form)
    q = np.random.default_rng(5).uniform(arm.lower, arm.upper, (4000, 6))
    shoulder = form.origin + form.up * form.planar.shoulder[1]
    distances = np.linalg.norm(flange_poses(arm, q)[:, :3, 3] - shoulder, axis=1)
    ahead = abs(form.planar.shoulder[0])  # an axis 2 in front of axis 1 is not known to the source
    assert distances.min() >= low - ahead - 1e-9
    assert distances.max() <= high + ahead + 1e-9
