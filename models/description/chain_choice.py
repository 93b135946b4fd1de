"""Which chain of a URDF file is the arm: one rule, what it chose, and what else could be meant.

The rule (docs/robots.md states it for users):

- The flange belongs to a link that 6 or 7 turning joints carry. Joints behind it that are a tool's are not counted:
  those with a finger's or gripper's name, those that hang beside another moving joint on the link that 6 joints carry,
  and those behind a link that is called a flange.
- The flange is the link that is called ``tool0``, ``flange``, ``ee_link`` or ``tcp`` (the first of these that is there,
  with any prefix), else the last one fixed to the last joint's link, but no camera, sensor, tool or self-collision
  link.
- The base is the first link of the arm: not ``world`` and its like, not what another arm of the file hangs on too; and
  ``base_link`` where that is one of several.
- Of several arms the first by name is taken.
- A prismatic joint below an arm is left out, and told with the alternatives: a linear axis belongs to the arm where the
  user calls a link below it the base, and it is the first joint from there.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from duocell.models.base.errors import InvalidRobot
from duocell.models.catalogue.dh import JOINT_COUNTS
from duocell.models.description.link_tree import Joint, LinkTree

FLANGES = ("tool0", "flange", "ee_link", "tcp")
"""What a flange is called, the likeliest first."""
_ENDS = ("link_ee", "ee", "eef", "end_effector", "end_effector_link", "tool_frame", "tool_link", "tool")
"""What else it is called."""
_WORLDS = ("world", "world_link", "map", "odom", "ground", "floor", "ground_plane", "origin")
_FINGERS = re.compile(r"finger|knuckle|thumb|jaw|claw|pincher")
_GRIPPERS = re.compile(r"grip|grasp|suction|vacuum|spindle|welding|torch")
_BESIDE = re.compile(
    r"camera|optical|realsense|sensor|lidar|laser|depth|collision|inertia|marker|aruco|bracket|adapter|cable|hose|visual|"
    r"force|torque|dummy|(?<![a-z])(cam|com|ft|imu|led|light|hand)(?![a-z])"
)
_MOST_SHOWN = 12
_MOST_NAMES = 40


@dataclass(frozen=True, slots=True)
class Alternative:
    """Another chain of the file.

    Attributes:
        base_link: see `ChainChoice`. tip: likewise.
        joints: names of its joints.
        reason: why it was not chosen.
    """

    base_link: str
    tip: str
    joints: tuple[str, ...]
    reason: str


@dataclass(frozen=True, slots=True)
class ChainChoice:
    """The chain that was chosen.

    Attributes:
        base_link: its base frame. tip: its flange frame.
        joints: names of its joints, from the base.
        reason: why, in a sentence.
        left_out: sentences on what the file has and the chain has not.
        alternatives: what else could be meant.
    """

    base_link: str
    tip: str
    joints: tuple[str, ...]
    reason: str
    left_out: tuple[str, ...] = ()
    alternatives: tuple[Alternative, ...] = ()


def choose_chain(tree: LinkTree, base_link: str | None = None, tip: str | None = None) -> ChainChoice:
    """The arm of a file.

    Args:
        tree: its links.
        base_link: link that the user calls the base. tip: link that he calls the flange.

    Raises:
        InvalidRobot: unknown links, a tip that does not hang on the base, joints between them that mimic, or slide but
            are not the first, or not 6 or 7 joints; pointer ``/base_link`` or ``/tip``.
    """
    for name, what in ((base_link, "base_link"), (tip, "tip")):
        if name is not None and name not in tree.above and name != tree.root:
            raise InvalidRobot(f"{what} {name!r} is no link of this URDF; its links are {_listed(tree)}.", f"/{what}")
    ends = _tips(tree, base_link)
    chosen = tip if tip is not None else _best(tree, ends, base_link)
    base = base_link if base_link is not None else _base(tree, chosen, ends)
    joints = _between(tree, base, chosen)
    _check(tree, base, chosen, joints)
    given = [what for what, name in (("base link", base_link), ("tip", tip)) if name is not None]
    others = _alternatives(tree, base, chosen, ends)
    return ChainChoice(
        base,
        chosen,
        tuple(joint.name for joint in joints),
        _reason(tree, chosen, tip is not None, given),
        _left_out(tree, base, chosen, joints, base_link is None),
        others[:_MOST_SHOWN],
    )


# --- the flange -------------------------------------------------------------------------------------------------------


def _tips(tree: LinkTree, base_link: str | None) -> list[str]:
    """Links that may be a flange: 6 or 7 turning joints carry them, none of which is a tool's."""
    found = []
    for link in tree.links:
        chain = _arm_chain(tree, link, base_link)
        if chain is None or len(chain) not in JOINT_COUNTS:
            continue
        turning = tuple(_after_axis(chain))
        if not _moves_tool(tree, turning) and not _goes_on(tree, turning):
            found.append(link)
    return found


def _after_axis(joints: Sequence[Joint]) -> Sequence[Joint]:
    """Joints without the linear axis that carries the others, if they begin with one."""
    return joints[1:] if joints and joints[0].slides else joints


def _goes_on(tree: LinkTree, chain: tuple[Joint, ...]) -> bool:
    """True if two or more joints follow one after the other that are no tool's: the chain is longer than any arm's."""
    following = list(tree.movers(chain[-1].child))
    if len(following) != 1 or len(chain) + tree.depth[chain[-1].child] <= 1 + max(JOINT_COUNTS):
        return False
    return not _of_tool(tree, (*chain, following[0]), following[0])


def _arm_chain(tree: LinkTree, link: str, base_link: str | None) -> tuple[Joint, ...] | None:
    """The turning joints of a link that belong to its own arm; None if it does not hang on the user's base."""
    if base_link is not None:
        way = _joints_between(tree, base_link, link)
        return None if way is None or any(joint.fault for joint in _after_axis(way)) else tuple(way)
    chain = tree.chain(link)
    shared = max((k for k in range(len(chain)) if _forks(tree, chain, k)), default=-1)
    return chain[shared + 1 :]


def _forks(tree: LinkTree, chain: tuple[Joint, ...], k: int) -> bool:
    """True if another arm hangs on the body that joint ``k`` of a chain carries."""
    arms = _arms_on(tree, chain[k].child)
    return bool(arms) and k + 1 < len(chain) and any(joint is not chain[k + 1] for joint in arms)


@lru_cache(maxsize=1024)
def _arms_on(tree: LinkTree, link: str) -> tuple[Joint, ...]:
    """The joints on the body of a link with which an arm begins."""
    least = min(JOINT_COUNTS)
    return tuple(joint for joint in tree.movers(link) if not joint.fault and 1 + tree.depth[joint.child] >= least)


def _moves_tool(tree: LinkTree, chain: tuple[Joint, ...]) -> bool:
    """True if one of the joints that an arm could consist of moves a tool."""
    return any(_of_tool(tree, chain, joint) for joint in chain[: max(JOINT_COUNTS)])


def _of_tool(tree: LinkTree, chain: tuple[Joint, ...], joint: Joint) -> bool:
    """True for a joint that moves a tool: see the rule."""
    before, least = chain.index(joint), min(JOINT_COUNTS)
    names = f"{joint.name} {joint.child}".lower()
    if before + 1 < least:
        return False
    if _FINGERS.search(names) or (before >= least and _GRIPPERS.search(names)):
        return True
    if before < least:
        return False
    carrier = chain[before - 1].child
    beside = [one for one in tree.movers(carrier) if one is not joint]
    return bool(beside) or any(_rank(link) < len(FLANGES) for link in tree.body(carrier))


def _best(tree: LinkTree, ends: list[str], base_link: str | None) -> str:
    """The likeliest flange; where there is none, the link that most turning joints carry."""
    if not ends:
        start = tree.root if base_link is None else base_link
        hanging = [link for link in tree.links if _joints_between(tree, start, link) is not None]
        chains = {link: _arm_chain(tree, link, base_link) for link in hanging}
        own = {k: chain for k, chain in chains.items() if chain and not _moves_tool(tree, chain)}
        return max(own, key=lambda link: (len(own[link]), len(tree.way(link))), default=start)
    return min(ends, key=lambda link: _order(tree, link, base_link))


def _order(tree: LinkTree, link: str, base_link: str | None) -> tuple[object, ...]:
    """What is compared to find the flange, least first."""
    chain = _arm_chain(tree, link, base_link) or ()
    name = _rank(link)
    beside = _is_beside(tree, link)
    first = chain[0].name if chain else ""
    return (beside, -len(chain), first, name, -len(tree.way(link)), link)


def _rank(link: str) -> int:
    """Place of a link's name among those of flanges; their number if it is none of them."""
    names = (*FLANGES, *_ENDS)
    lower = link.lower()
    for index, name in enumerate(names):
        if lower == name or re.search(rf"[_/\-.]{name}$", lower):
            return index
    return len(names)


def _is_beside(tree: LinkTree, link: str) -> bool:
    """True for a camera, a sensor, a tool, a self-collision link, or what is fixed to one of these."""
    while link in tree.above and tree.above[link].fixed:
        name = link.lower()
        if _FINGERS.search(name) or _GRIPPERS.search(name) or (_BESIDE.search(name) and _rank(name) >= len(FLANGES)):
            return True
        link = tree.above[link].parent
    return False


# --- the base ---------------------------------------------------------------------------------------------------------


def _base(tree: LinkTree, tip: str, ends: list[str]) -> str:
    """The first link of the arm that ends at ``tip``."""
    chain = _arm_chain(tree, tip, None) or ()
    if not chain:
        return tree.root
    carrier = chain[0].parent
    links = [carrier]
    while links[0] in tree.above and tree.above[links[0]].fixed:
        links.insert(0, tree.above[links[0]].parent)
    others = {joint.name for end in ends for joint in (_arm_chain(tree, end, None) or ())[:1]} - {chain[0].name}
    own = [link for link in links if link.lower() not in _WORLDS and not _carries(tree, link, others)]
    named = [link for link in own if re.search(r"(^|[_/\-.])base(_?link)?$", link.lower())]
    return (named or own or [carrier])[0]


def _carries(tree: LinkTree, link: str, joints: set[str]) -> bool:
    """True if one of the joints hangs on a link, over fixed joints alone."""
    waiting = [link]
    for one in waiting:
        if any(joint.name in joints for joint in tree.below[one]):
            return True
        waiting += [joint.child for joint in tree.below[one] if joint.fixed]
    return False


# --- the joints between -----------------------------------------------------------------------------------------------


def _joints_between(tree: LinkTree, base: str, tip: str) -> list[Joint] | None:
    """Moving joints from the body of one link to another; None if that does not hang on it."""
    top, joints, link = tree.rigid(base), [], tree.rigid(tip)
    while link != top:
        if link not in tree.above:
            return None
        joints.append(tree.above[link])
        link = tree.rigid(joints[-1].parent)
    return joints[::-1]


def _between(tree: LinkTree, base: str, tip: str) -> list[Joint]:
    joints = _joints_between(tree, base, tip)
    if joints is None:
        raise InvalidRobot(f"link {tip} does not hang on {base}; swap base link and tip or name others.", "/tip")
    return joints


def _check(tree: LinkTree, base: str, tip: str, joints: list[Joint]) -> None:
    """Refuse chains with joints that are no plain turning joints, and those without inverse kinematics."""
    for joint in _after_axis(joints):
        if joint.fault:
            raise InvalidRobot(
                f"joint {joint.name} on the way to {tip} {joint.fault}; only revolute and continuous joints are "
                "supported, and a prismatic one as the first, a linear axis. Name a tip in front of it.",
                "/tip",
            )
    if len(joints) not in JOINT_COUNTS:
        names = ", ".join(joint.name for joint in joints) or "none"
        raise InvalidRobot(
            f"the chain from {base} to {tip} has {len(joints)} {_what(joints)} ({names}); arms of 6 or 7 are "
            "supported. "
            f"Name base link and tip of an arm; the links are {_listed(tree)}.",
            "/tip",
        )


def _what(joints: Sequence[Joint]) -> str:
    return "joints with its linear axis" if joints and joints[0].slides else "turning joints"


def _listed(tree: LinkTree) -> str:
    """Names for an error message."""
    more = f" and {len(tree.links) - _MOST_NAMES} more" if len(tree.links) > _MOST_NAMES else ""
    return ", ".join(tree.links[:_MOST_NAMES]) + more


# --- what is told -----------------------------------------------------------------------------------------------------


def _reason(tree: LinkTree, tip: str, told: bool, given: list[str]) -> str:
    if told:
        return f"The {' and the '.join(given)} were given." if len(given) > 1 else f"The {given[0]} was given."
    if _rank(tip) < len(FLANGES):
        return f"{tip} has a flange's name."
    if tree.above.get(tip) is not None and tree.above[tip].fixed:
        return f"{tip} is the last link fixed to the last joint's, and no tool, camera or sensor."
    return f"{tip} is the link that the last joint of the arm carries."


def _left_out(tree: LinkTree, base: str, tip: str, joints: list[Joint], chosen: bool) -> tuple[str, ...]:
    """What hangs below the base and behind the flange."""
    found = []
    below = tree.way(base)
    if below and chosen:
        moving = [joint.name for joint in below if joint.moves]
        stays = f"; joint {', '.join(moving)} stays at zero" if moving else ""
        found.append(f"Below the base {base} and not part of the arm: {_names([j.parent for j in below])}{stays}.")
    behind = [joint.name for joint in tree.movers(tip) if joint not in joints]
    if behind:
        found.append(f"Behind the last joint, taken for tools that stay where they are at zero: {_names(behind)}.")
    return tuple(found)


def _names(names: list[str]) -> str:
    return ", ".join(names[:8]) + (f" and {len(names) - 8} more" if len(names) > 8 else "")


def _alternatives(tree: LinkTree, base: str, tip: str, ends: list[str]) -> tuple[Alternative, ...]:
    """Other flanges of the same arm, other arms, and chains with the tool's joints."""
    chosen = _between(tree, base, tip)
    found = []
    for link in tree.body(tip):
        if link != tip and tree.rigid(tip) != tree.rigid(base):
            reason = "a tool, camera, sensor or collision link" if _is_beside(tree, link) else "another frame there"
            found.append(_alternative(base, link, chosen, reason))
    first = {joint.name for joint in chosen}
    for link in sorted(ends, key=lambda link: _order(tree, link, None)):
        joints = _arm_chain(tree, link, None) or ()
        if len(joints) in JOINT_COUNTS and joints[0].name not in first:
            first |= {joint.name for joint in joints}
            found.append(_alternative(_base(tree, link, ends), link, list(joints), "another arm of the file"))
    axis = _axis_below(tree, base, chosen)
    if axis is not None:
        found.append(_alternative(axis.parent, tip, [axis, *chosen], "the arm with the linear axis that carries it"))
    if len(chosen) + 1 in JOINT_COUNTS:
        behind = [joint for joint in tree.movers(tip) if joint not in chosen and not joint.fault]
        reason = "its last joint was taken for a tool's"
        found += [_alternative(base, joint.child, [*chosen, joint], reason) for joint in behind]
    return tuple(found)


def _axis_below(tree: LinkTree, base: str, joints: list[Joint]) -> Joint | None:
    """The linear axis on which an arm stands without having it, if it has room for one joint more."""
    axis = tree.above.get(tree.rigid(base))
    fits = bool(joints) and not joints[0].slides and len(joints) + 1 in JOINT_COUNTS
    return axis if fits and axis is not None and axis.slides else None


def _alternative(base: str, tip: str, joints: list[Joint], reason: str) -> Alternative:
    return Alternative(base, tip, tuple(joint.name for joint in joints), reason)
