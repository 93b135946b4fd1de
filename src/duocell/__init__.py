"""Where to bolt down the arms of a robot workcell: the interface for programs.

A cell comes from a request (the JSON of ``POST /v1/layouts``) or is built from objects; `optimize` finds its layout::

    import duocell

    request = duocell.read_request("examples/line.json")
    layout = duocell.optimize(request.cell, request.settings)
    for placement in layout.placements:
        print(placement.arm, placement.position, placement.yaw)

==================== ===================================================================================
name                 what it is
==================== ===================================================================================
`read_request`       a request from a file, JSON or a dictionary -> `Request` with ``cell`` and ``settings``
`Request`            what was read; ``request.document(layout)`` is what ``duocell solve -o`` writes
`Cell`               one task and the arms that carry it out
`Task`               the poses of the part; `line` and `task_from_poses` make one
`Arm`                a robot, its tool and grasp, where its base may stand; `make_arm` makes one
`pose`               a 4x4 transform from a position and an orientation
`optimize`           the best layout of a cell, with the proof that it is, or that there is none -> `Layout`
`evaluate`           a given layout, scored and verified without optimising -> `Layout`
`Settings`           seed, time limit, proof, alternatives, explanation; `CertificateSettings`: how hard to prove
`Layout`             outcome, placements, reasons, certificate
`result_document`    a layout as the ``result`` of the service's JSON
`InvalidRequest`     a request that cannot be carried out, with everything that is wrong with it
`DuocellError`       base of all errors raised on purpose, that one too
==================== ===================================================================================

Lengths are metres and angles radians. Poses are (4, 4) arrays that take a point of the named frame into the frame that
they are given in. The answer is a function of cell and settings, unless a time limit cuts it.

A cell of a task and arms alone has no bodies, and collisions are not looked for. Obstacles, floor, clearances and
couplings are objects of ``duocell.models.cell``, which `read_request` makes of a request (docs/request.md).

The names above stay what they are; whatever else is in ``duocell.models``, ``duocell.optimizer`` and
``duocell.service`` may be used and may change with any release. They are loaded when they are first asked for:
``import duocell`` by itself costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from duocell.building import make_arm, pose
    from duocell.evaluation import evaluate
    from duocell.models.base.errors import DuocellError
    from duocell.models.cell.cell import Cell
    from duocell.models.cell.task import Task, line, task_from_poses
    from duocell.models.robot.arm import Arm
    from duocell.optimizer.optimize import optimize
    from duocell.optimizer.results.layout import Layout
    from duocell.optimizer.settings import CertificateSettings, Settings
    from duocell.requests import Request, read_request, result_document
    from duocell.service.common.issues import InvalidRequest

__all__ = [
    "Arm",
    "Cell",
    "CertificateSettings",
    "DuocellError",
    "InvalidRequest",
    "Layout",
    "Request",
    "Settings",
    "Task",
    "evaluate",
    "line",
    "make_arm",
    "optimize",
    "pose",
    "read_request",
    "result_document",
    "task_from_poses",
]

_HOMES = {
    "duocell.building": ("make_arm", "pose"),
    "duocell.evaluation": ("evaluate",),
    "duocell.models.base.errors": ("DuocellError",),
    "duocell.models.cell.cell": ("Cell",),
    "duocell.models.cell.task": ("Task", "line", "task_from_poses"),
    "duocell.models.robot.arm": ("Arm",),
    "duocell.optimizer.optimize": ("optimize",),
    "duocell.optimizer.results.layout": ("Layout",),
    "duocell.optimizer.settings": ("CertificateSettings", "Settings"),
    "duocell.requests": ("Request", "read_request", "result_document"),
    "duocell.service.common.issues": ("InvalidRequest",),
}
"""Which module defines which names. The command line must not wait for solvers: nothing is loaded before it is used."""
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}


if not TYPE_CHECKING:  # for type checkers it would make everything a name of this package

    def __getattr__(name: str) -> Any:
        """Load a name of the interface."""
        if name not in _HOME_OF:
            raise AttributeError(f"module 'duocell' has no attribute {name!r}")
        value = globals()[name] = getattr(import_module(_HOME_OF[name]), name)
        return value


def __dir__() -> list[str]:
    """What `dir` and completion show."""
    return sorted([*globals(), *__all__])
