"""How many objects, lists and values the bytes of a document can hold, counted before it is read.

A document of a few megabytes can become gigabytes of objects. Every object has an opening brace, every list an opening
bracket, and every further value a comma: three counts of bytes, which take milliseconds, say whether a request of the
allowed number of poses, arms and shapes can have so many. Those in texts are counted as well: no text is so long.
"""

from __future__ import annotations

from typing import NamedTuple

from duocell.service.common.issues import InvalidRequest, Issue
from duocell.service.settings import Limits
from duocell.service.validation.count_limits import CODE

ONCE = 1000
"""Of each, for what is there once."""


class Structure(NamedTuple):
    """How much there is of each."""

    objects: int
    lists: int
    values: int


def most_allowed(limits: Limits) -> Structure:
    """More than any request within the limits has.

    A pose has at most 14 values in 2 objects and 5 lists; each arm may have a row of joint values for it, and its share
    in a grasp of a segment of two poses.
    """
    arms, poses = limits.max_arms, limits.max_poses
    solids = limits.max_obstacles + (arms + 1) * limits.max_shapes
    corners = (limits.max_polygons + 2 * arms + 1) * limits.max_corners
    ties = limits.max_couplings * (arms + 10)
    return Structure(
        objects=poses * (5 + 2 * arms) + 5 * solids + 40 * arms + limits.max_couplings + ONCE,
        lists=poses * (6 + 4 * arms) + 8 * solids + corners + 60 * arms + 3 * limits.max_couplings + ONCE,
        values=poses * (20 + 24 * arms) + 30 * solids + 3 * corners + 460 * arms + ties + ONCE,
    )


def check_structure(body: bytes, limits: Limits) -> None:
    """Refuse a document that holds more than any request that is allowed.

    Raises:
        InvalidRequest: it does; one issue.
    """
    found = Structure(body.count(b"{"), body.count(b"["), body.count(b",") + 1)
    for what, number, most in zip(Structure._fields, found, most_allowed(limits), strict=True):
        if number > most:
            detail = (
                f"The body has {number} {what}, more than any request with the allowed numbers of poses, arms and "
                f"shapes ({most}). Send fewer."
            )
            raise InvalidRequest([Issue("", detail, CODE)])
