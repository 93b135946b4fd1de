"""The tree of links of a URDF document: who carries whom, over which joint."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from xml.etree import ElementTree

from duocell.models.base.errors import InvalidRobot

TURNING = ("revolute", "continuous")
"""Types of joints that an arm may consist of, beside fixed ones."""


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint of the tree.

    Attributes:
        name: its name. parent: link above. child: link below.
        fault: why it cannot be part of an arm, or "".
        fixed: it does not move.
        slides: it is prismatic, and nothing else is wrong with it: a linear axis may carry an arm.
    """

    name: str
    parent: str
    child: str
    fault: str
    fixed: bool
    slides: bool = False

    @property
    def moves(self) -> bool:
        """True unless it is fixed."""
        return not self.fixed


@dataclass(frozen=True, eq=False, slots=True)
class LinkTree:
    """Links and joints of a document.

    Attributes:
        links: names, in the order of the file.
        above: link -> the joint that carries it; the root has none.
        below: link -> the joints that it carries, in the order of the file.
        depth: link -> how many turning joints hang on it one after the other, at most, up to the first that no arm can
            have.
    """

    links: tuple[str, ...]
    above: dict[str, Joint]
    below: dict[str, tuple[Joint, ...]]
    depth: dict[str, int]

    @staticmethod
    def of(document: ElementTree.Element) -> LinkTree:
        """The tree of a ``<robot>`` element whose links and joints are named.

        Raises:
            InvalidRobot: the links form no tree; the pointer names a joint where one is to blame.
        """
        links = tuple(link.get("name", "") for link in document.findall("link"))
        above: dict[str, Joint] = {}
        below: dict[str, list[Joint]] = {link: [] for link in links}
        for element in document.findall("joint"):
            joint = _joint(element)
            if joint.child in above:
                raise InvalidRobot(
                    f"the links form no tree: {joint.child} hangs on two joints, {above[joint.child].name} and "
                    f"{joint.name}. Keep one.",
                    f"/joints/{joint.name}",
                )
            above[joint.child] = joint
            below[joint.parent].append(joint)
        tree = LinkTree(links, above, {link: tuple(joints) for link, joints in below.items()}, {})
        for link in reversed(_from_the_root(tree)):
            joints = [joint for joint in tree.below[link] if not joint.fault]
            tree.depth[link] = max((tree.depth[joint.child] + joint.moves for joint in joints), default=0)
        return tree

    @property
    def root(self) -> str:
        """The link that hangs on nothing."""
        return next(link for link in self.links if link not in self.above)

    def way(self, link: str) -> list[Joint]:
        """Joints from the root to a link."""
        joints = []
        while link in self.above:
            joints.append(self.above[link])
            link = joints[-1].parent
        return joints[::-1]

    def rigid(self, link: str) -> str:
        """The topmost link that is rigidly fixed to a link: equal for all links of one body."""
        while link in self.above and self.above[link].fixed:
            link = self.above[link].parent
        return link

    def body(self, link: str) -> list[str]:
        """All links of the rigid body of a link, from the topmost downwards."""
        found = [self.rigid(link)]
        for one in found:
            found += [joint.child for joint in self.below[one] if joint.fixed]
        return found

    def movers(self, link: str) -> Iterator[Joint]:
        """The joints that move against the body of a link and hang on it."""
        for one in self.body(link):
            yield from (joint for joint in self.below[one] if joint.moves)

    def chain(self, link: str) -> tuple[Joint, ...]:
        """The turning joints above a link, down to it, from the last joint on that no arm can have."""
        chain: list[Joint] = []
        for joint in reversed(self.way(link)):
            if joint.fault:
                break
            if joint.moves:
                chain.append(joint)
        return tuple(reversed(chain))


def _joint(element: ElementTree.Element) -> Joint:
    kind = str(element.get("type"))
    ends = [element.find(end) for end in ("parent", "child")]
    parent, child = ("" if end is None else end.get("link", "") for end in ends)
    fault = ""
    if element.find("mimic") is not None:
        fault = "follows another joint (mimic)"
    elif kind not in (*TURNING, "fixed"):
        fault = f"is {kind}"
    slides = kind == "prismatic" and element.find("mimic") is None
    return Joint(element.get("name", ""), parent, child, fault, kind == "fixed" and not fault, slides)


def _from_the_root(tree: LinkTree) -> list[str]:
    """All links, each after the one that carries it; refuse circles and several trees."""
    roots = [link for link in tree.links if link not in tree.above]
    reached = [roots[0]] if roots else []
    for link in reached:
        reached += [joint.child for joint in tree.below[link]]
    lost = set(tree.links) - set(reached)
    if not lost:
        return reached
    if len(roots) > 1:
        raise InvalidRobot(
            f"the links form several trees: {', '.join(roots[:5])} hang on no joint. Connect them by fixed joints, or "
            "send one robot."
        )
    name = next(tree.above[link].name for link in tree.links if link in lost)
    raise InvalidRobot(
        f"the links form no tree: joint {name} closes a circle. Every link but one must be the child of exactly one "
        "joint, and none may hang on itself.",
        f"/joints/{name}",
    )
