"""What excludes an arm's boxes: the share of its base region, over all postures, that every cause rules out."""

from __future__ import annotations

import numpy as np

from duocell.optimizer.certificate.arm_tree import ArmTree
from duocell.optimizer.certificate.exclusion.causes import BELOW, NONE, Cause


def excluded_shares(tree: ArmTree) -> list[tuple[Cause, float]]:
    """Causes and the shares of base positions and postures that they exclude, largest first; they add up to 1 at most.

    A box that several causes could exclude is counted for the first that did.
    """
    nodes, causes = tree.nodes, tree.excluder.causes.all
    leaves = nodes.leaves()
    half = nodes.boxes(leaves).half
    free = tree.region.high > tree.region.low
    sizes = np.prod(half[:, free], axis=1)
    total = float(np.sum(sizes))
    shares = np.bincount(nodes.code[leaves], sizes, minlength=len(causes)) / (total or 1.0)
    order = np.argsort(-shares, kind="stable")
    return [(causes[k], float(shares[k])) for k in order if shares[k] > 0.0 and k not in (NONE, BELOW)]
