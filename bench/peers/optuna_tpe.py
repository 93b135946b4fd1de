"""Optuna with its default sampler (tree-structured Parzen estimators), one trial at a time."""

from __future__ import annotations

import numpy as np
import optuna

from bench.comparison.problem import Problem


def search(problem: Problem, seed: int) -> None:
    """Ask for trials until stopped."""
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=seed))

    def objective(trial: optuna.Trial) -> float:
        x = [
            trial.suggest_float(f"x{i}", low, high)
            for i, (low, high) in enumerate(zip(problem.low, problem.high, strict=True))
        ]
        return float(problem.costs(np.array([x]))[0])

    while True:
        study.optimize(objective, n_trials=1000)
