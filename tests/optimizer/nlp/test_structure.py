"""Assembled derivatives of whole programs against CasADi's own and against finite differences."""

from __future__ import annotations

from time import perf_counter

import casadi as ca
import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_from_rpy, rotation_x, rotation_z, transform
from duocell.models.catalogue import catalogue
from duocell.models.objective.measure import Measure
from duocell.models.objective.objective import JOINT_AVAILABILITY
from duocell.models.objective.registry import MEASURES
from duocell.optimizer.nlp.pose_rows import TARGET, target_numbers
from duocell.optimizer.nlp.structure import Structure, structure_of

UPRIGHT = tuple(np.eye(3).ravel())
TILTED = tuple((rotation_x(1.0) @ rotation_z(0.2)).ravel())
SHAPES = [
    (("puma560",), (UPRIGHT,), 3, True, True, True),
    (("puma560",), (UPRIGHT,), 3, False, False, False),
    (("ur10e",), (TILTED,), 2, True, False, True),
    (("iiwa14",), (UPRIGHT,), 3, False, True, False),
    (("yumi_left",), (UPRIGHT,), 2, False, True, True),
    (("puma560", "ur5e"), (UPRIGHT, TILTED), 2, True, True, True),
    (("ur5e", "iiwa14"), (UPRIGHT, UPRIGHT), 3, False, True, True),
    (("kr6_r900",), (UPRIGHT,), 1, True, True, True),
]


ProgramShape = tuple[tuple[str, ...], tuple[tuple[float, ...], ...], int, bool, bool, bool]
"""Robots, mounts, number of poses, and which rows there are, as `SHAPES`."""
Measures = tuple[Measure, ...]
USUAL = JOINT_AVAILABILITY.measures


def built(shape: ProgramShape, measures: Measures = USUAL) -> Structure:
    names, mounts, poses, keep, steps, cuts = shape
    robots = tuple(catalogue.robot(name) for name in names)
    return structure_of(robots, mounts, poses, keep, steps, cuts, measures=measures)


def numbers(
    structure: Structure, rng: np.random.Generator, measures: Measures = USUAL
) -> tuple[Floats, Floats, Floats]:
    """A random point, parameters that make sense, multipliers."""
    parts = []
    for robot in structure.robots:
        m, n = structure.poses, robot.dof
        turns = [rotation_from_rpy(rpy) for rpy in rng.uniform(-1.0, 1.0, (m, 3))]
        targets = transform(np.array(turns), rng.uniform(-1.0, 1.0, (m, 3)))
        parts += [target_numbers(targets).T.ravel(), rng.choice([0.0, 1.0, 2.5], m)]
        for measure in measures:
            parts += [rng.uniform(0.5, 2.0, 1), rng.uniform(0.0, 5.0, measure.size(robot))]
        if structure.cuts:
            parts.append(rng.normal(size=m * n))
    p = np.concatenate(parts)
    assert len(p) == structure.parameters.numel()
    return rng.uniform(-1.0, 1.0, structure.unknowns.numel()), p, rng.normal(size=structure.rows.numel())


CASES = [(shape, USUAL) for shape in SHAPES] + [(SHAPES[0], tuple(MEASURES.values()))]


@pytest.mark.parametrize(("shape", "measures"), CASES)
def test_assembled_derivatives_are_casadis_own(shape: ProgramShape, measures: Measures) -> None:
    structure = built(shape, measures)
    x, p = structure.unknowns, structure.parameters
    at, params, lam = numbers(structure, np.random.default_rng(0), measures)
    multiplier, multipliers = ca.MX.sym("f"), ca.MX.sym("g", structure.rows.numel())
    lagrangian = multiplier * structure.objective + ca.dot(multipliers, structure.rows)
    hessian, _ = ca.hessian(lagrangian, x)
    oracle = ca.Function(
        "oracle",
        [x, p, multiplier, multipliers],
        [
            structure.objective,
            ca.gradient(structure.objective, x),
            structure.rows,
            ca.jacobian(structure.rows, x),
            ca.triu(hessian),
        ],
    )
    expected = [np.array(ca.DM(value).full()) for value in oracle(at, params, 0.7, lam)]
    f, gradient = (np.array(value) for value in structure.gradient(at, params))
    g, jacobian = (np.array(ca.DM(value).full()) for value in structure.jacobian(at, params))
    upper = np.array(structure.hessian(at, params, 0.7, lam).full())
    for ours, theirs in zip((f, gradient, g, jacobian, upper), expected, strict=True):
        assert ours.shape == theirs.shape
        assert np.allclose(ours, theirs, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize(
    "shape", [SHAPES[0], SHAPES[4], SHAPES[5]], ids=lambda shape: "-".join(map(str, (*shape[0], *shape[2:])))
)
def test_assembled_derivatives_are_the_limits_of_differences(
    shape: ProgramShape,
) -> None:
    structure = built(shape)
    at, params, lam = numbers(structure, np.random.default_rng(1))
    lam_f, step = 1.3, 1e-6

    def first(x: Floats) -> tuple[Floats, Floats]:
        _, gradient = structure.gradient(x, params)
        rows, jacobian = structure.jacobian(x, params)
        return np.array(rows).ravel(), lam_f * np.array(gradient).ravel() + np.array(jacobian.full()).T @ lam

    _, jacobian = structure.jacobian(at, params)
    upper = np.array(structure.hessian(at, params, lam_f, lam).full())
    full = upper + np.triu(upper, 1).T
    for i, direction in enumerate(np.eye(len(at))):
        ahead, behind = first(at + step * direction), first(at - step * direction)
        slope, curve = ((a - b) / (2.0 * step) for a, b in zip(ahead, behind, strict=True))
        assert np.allclose(np.array(jacobian.full())[:, i], slope, rtol=0.0, atol=1e-6)
        assert np.allclose(full[i], curve, rtol=1e-6, atol=1e-5)


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: "-".join(map(str, (*shape[0], *shape[2:]))))
def test_only_the_upper_triangle_is_stored_and_blocks_stay_sparse(
    shape: ProgramShape,
) -> None:
    structure = built(shape)
    rows, columns = structure.hessian.sparsity_out(0).get_triplet()
    assert all(i <= j for i, j in zip(rows, columns, strict=True))
    m = structure.poses
    most = sum(10 + 4 * r.dof * m + m * r.dof * (r.dof + 1) // 2 for r in structure.robots)
    assert len(rows) <= most


def test_objective_is_the_sum_over_arms_poses_and_joints() -> None:
    structure = built(SHAPES[5])
    at, params, _ = numbers(structure, np.random.default_rng(2))
    total, i, j = 0.0, 0, 0
    for robot in structure.robots:
        m, n = structure.poses, robot.dof
        joints = at[i + 4 : i + 4 + m * n].reshape(m, n)
        counts = params[j + TARGET * m :][:m]
        factor, weights, reference = np.split(params[j + TARGET * m + m :][: 1 + 2 * n], [1, 1 + n])
        total += factor[0] * np.sum(counts[:, None] * weights * (joints - reference) ** 2)
        i, j = i + 4 + m * n, j + TARGET * m + m + 1 + 2 * n + m * n
    assert float(structure.gradient(at, params)[0]) == pytest.approx(total, rel=1e-13)


def test_shapes_are_compiled_once() -> None:
    assert built(SHAPES[0]) is built(SHAPES[0])
    assert built(SHAPES[0]) is not built(SHAPES[1])


def test_size_of_a_long_task_does_not_slow_the_build() -> None:
    """Mapped functions, no expansion: a thousand poses are stated in well under a second or two."""
    started = perf_counter()
    structure = structure_of((catalogue.robot("rx160"),), (UPRIGHT,), 1000, True, True, False)
    assert structure.unknowns.numel() == 4 + 6000
    assert structure.rows.numel() == 7 * 1000 + 6 * 999
    assert perf_counter() - started < 5.0
