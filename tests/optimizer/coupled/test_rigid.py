"""Two arms on one stand, against every place and yaw of the stand on a lattice."""

from __future__ import annotations

import numpy as np
import pytest

from bench.searches.own_stands import own_stands, own_task
from bench.trials.coupled_tasks import RIGID, coupled_task
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Rigid
from duocell.optimizer.optimize import optimize
from duocell.optimizer.settings import CertificateSettings, Settings

STEPS, YAWS = 12, 36


def best_on_lattice(cell: Cell) -> float:
    """The cheapest layout with the stand on a lattice, in any postures, by kinematics of its own."""
    stand, base = cell.couplings[0], cell.arms[0].base
    assert isinstance(stand, Rigid)
    sides = [np.linspace(side.low, side.high, STEPS) for side in (base.x, base.y)]
    yaws = np.linspace(-np.pi, np.pi, YAWS, endpoint=False)
    x, y, yaw = (values.ravel() for values in np.meshgrid(*sides, yaws, indexing="ij"))
    first = np.column_stack([x, y, np.full(len(x), base.z.middle)])
    px, py, pz = stand.x.middle, stand.y.middle, stand.z.middle
    second = first + np.column_stack(
        [np.cos(yaw) * px - np.sin(yaw) * py, np.sin(yaw) * px + np.cos(yaw) * py, 0 * yaw]
    )
    second[:, 2] += pz
    total = np.zeros(len(x))
    for index, (places, turned) in enumerate(((first, yaw), (second, yaw + stand.yaw.middle))):
        region = cell.arms[index].base
        low, high = region.bounds[:3].T
        allowed = np.all((places >= low - 1e-9) & (places <= high + 1e-9), axis=1)
        allowed &= np.array([region.yaw_outside(float(value)) < 1e-9 for value in turned])
        found = own_stands(own_task(cell, index), places, turned)
        total += np.where(allowed, np.min(np.where(found.wrong == 0.0, found.objective, np.inf), axis=0), np.inf)
    return float(np.min(total))


@pytest.mark.parametrize("seed", [RIGID, RIGID + 4, RIGID + 8])
def test_no_place_of_the_stand_on_a_lattice_is_better(seed: int) -> None:
    cell = coupled_task(seed).cell
    stand = cell.couplings[0]
    assert isinstance(stand, Rigid)
    assert stand.x.fixed
    layout = optimize(cell, Settings(time_limit=120.0))
    best = best_on_lattice(cell)
    assert layout.objective is not None
    assert layout.objective <= best


def test_it_is_proved() -> None:
    layout = optimize(coupled_task(RIGID).cell, Settings(certificate=CertificateSettings(0.02, 60.0)))
    assert layout.certificate is not None
    assert layout.certificate.proved
    assert layout.objective is not None
    assert layout.certificate.lower_bound is not None
    alone = sum(arm.lower_bound or 0.0 for arm in layout.certificate.arms)
    assert alone < 0.95 * layout.certificate.lower_bound <= 0.95 * layout.objective
