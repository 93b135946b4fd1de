"""The numbers of the search of arms without a reduced problem, in one place."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class UnreducedParameters:
    """What the stages keep and how long they iterate.

    Measured on 60 fresh tasks of iiwa14, iiwa7 and Panda (5 to 20 poses) against the best of all methods; a miss is
    more than 0.1 % above it. Costs are per pose in units of the mean weights, so that they mean the same for every
    request.

    Attributes:
        seeds: that survive the draw. 64 and 256: no miss in 60 and in 180 runs; 128: 2 in 120.
        drawn: postures per seed that the draw chooses from by kinematics alone: 1 (random bases) missed 1 in 45.
        reach_iterations, reach_pull: towards the middle pose. With a pull of 0.3 instead the seeds run together, 10
            freedoms on 6 rows, and lose basins that 1024 seeds do not make up for.
        key_poses: per segment, at first. The spread to them goes in ``spread_parts`` of the way.
        spread_iterations, spread_pull: in every part. key_iterations, key_pull: on the key poses.
        spread_kept: distinct seeds that go on to ``middle_poses`` poses.
        middle_poses: most poses that the middle stages look at; longer tasks are looked at whole by the last
            ``whole_kept`` only, and are ranked once more there.
        arrive_iterations: with the bases fixed, until the poses between the key poses are reached: interpolated joints
            miss them by up to 0.3, and would drag the bases along (iiwa14 on a tilted mount: 51.8 instead of 47.3).
        middle_iterations, middle_pull: before the next cut, to ``middle_kept`` distinct seeds.
        final_iterations, final_pull: of those. Seeds that still move, and are not ``hopeless`` times as dear as the
            best, get ``more_iterations`` twice.
        restraint: error [m or rad] at which a pose goes half as fast downhill in the final iterations; before, where
            seeds still have far to go, ten times as much. Without it poses near the edge of reach never arrive:
            gen72, 5 poses: 97.3 instead of 73.8.
        soft, stiff: penalty of a squared radian beyond a limit, before and after the last cut.
        unreached, far: errors [m or rad] that end a seed after the first pose, and after the key poses.
        over_penalty, step_penalty, error_penalty: of a radian beyond limits, a radian of too long a step, and a metre
            or radian of error in the ranking. Soft: IPOPT repairs a little of each.
        same_joints, same_base: rad and m; seeds nearer than that at every looked-at pose count once.
        near_joints, near_base: the same for candidates of the local solver.
        polished: distinct optima that IPOPT is asked for, of twice as many candidates; ``polished_endless`` where
            joints turn without end and cost nothing: Gauss-Newton leaves those far from their optimum, and its ranking
            says little (gen3: 15.3 before IPOPT, 9.3 after).
        worth: candidates dearer than this many times the best are not polished.
        beaten: local solves are given up where they are sure to cost this many times the best.
        repairable_over, repairable_step: rad beyond limits, and times the allowed step; candidates beyond either come
            last, most of them are failed solves of 70 ms.
        bases: distinct bases that get a path recombined from all seeds' poses.
        carriage_places, carriage_nodes: of an arm with a closed form on a linear axis: places of the carriage from
            which its branches are taken, and how many of these are kept for each pose, for every base of the net.
            Of 48 tasks from a fixed base one cost 155.6 without this net, and 101.7 with it.
        carriage_bases: bases of the region that it tries where the stages left nothing.
        layer_draws, layer_iterations, layer_nodes, layer_spacing: fresh postures per pose and base, iterations with the
            base fixed, nodes kept per pose, and how far apart they are [rad].
    """

    seeds: int = 256
    drawn: int = 16
    reach_iterations: int = 6
    reach_pull: float = 0.03
    key_poses: int = 4
    spread_parts: tuple[float, ...] = (0.5, 1.0)
    spread_iterations: int = 2
    spread_pull: float = 0.15
    key_iterations: int = 5
    key_pull: float = 0.4
    spread_kept: int = 64
    middle_poses: int = 24
    arrive_iterations: int = 3
    middle_iterations: int = 3
    middle_pull: float = 0.3
    middle_kept: int = 20
    final_iterations: int = 8
    final_pull: float = 0.5
    more_iterations: int = 10
    hopeless: float = 2.0
    whole_kept: int = 10
    restraint: float = 5e-3
    soft: float = 30.0
    stiff: float = 300.0
    unreached: float = 5e-2
    far: float = 0.1
    over_penalty: float = 3.0
    step_penalty: float = 3.0
    error_penalty: float = 30.0
    same_joints: float = 0.35
    same_base: float = 0.08
    near_joints: float = 0.15
    near_base: float = 0.03
    polished: int = 4
    polished_endless: int = 10
    worth: float = 1.15
    beaten: float = 1.0
    repairable_over: float = 0.05
    repairable_step: float = 1.3
    bases: int = 4
    layer_draws: int = 32
    layer_iterations: int = 5
    layer_nodes: int = 24
    layer_spacing: float = 0.12
    carriage_places: int = 48
    carriage_nodes: int = 256
    carriage_bases: int = 16


PARAMETERS = UnreducedParameters()
THOROUGH = replace(PARAMETERS, polished=16, polished_endless=24, worth=4.0, beaten=4.0)
"""Where the best of the usual optima will not do, because its way between the poses cannot be gone."""
