"""Errors of duocell, one tree for all three floors.

DuocellError
├── InvalidInput            a value that cannot be used; carries a pointer to it
│   ├── InvalidRotation     not a rotation within the accepted tolerance
│   ├── InvalidTask         poses, line or arc that define no path
│   ├── InvalidRobot        D-H table, URDF or limits that define no arm
│   ├── UnknownRobot        a name the catalogue does not hold
│   └── UnknownMesh         an identifier nothing was uploaded under
├── InvalidRequest          everything that is wrong with a request (duocell.service.common.issues)
└── SolverFailure           an engine broke down; never the user's fault

Every class has a stable ``code``; the service maps codes to HTTP problems.
"""

from __future__ import annotations


class DuocellError(Exception):
    """Base of all errors raised on purpose.

    Attributes:
        code: stable machine-readable name of the error class.
        detail: what is wrong, with the value, what is allowed and what to do.
    """

    code = "error"

    def __init__(self, detail: str) -> None:
        super().__init__(detail)
        self.detail = detail


class InvalidInput(DuocellError):
    """A value that cannot be used.

    Attributes:
        pointer: JSON pointer relative to the object being built ("" = the object itself).
    """

    code = "invalid-input"

    def __init__(self, detail: str, pointer: str = "") -> None:
        super().__init__(detail)
        self.pointer = pointer


class InvalidRotation(InvalidInput):
    """Numbers that are no rotation within the accepted tolerance."""

    code = "invalid-rotation"


class InvalidTask(InvalidInput):
    """Poses or a path generator that define no task."""

    code = "invalid-task"


class InvalidRobot(InvalidInput):
    """A D-H table, URDF, limits or reference that define no usable arm."""

    code = "invalid-robot"


class UnknownRobot(InvalidInput):
    """A robot name the catalogue does not hold; the detail lists near names."""

    code = "unknown-robot"


class UnknownMesh(InvalidInput):
    """An identifier of a mesh that nobody uploaded."""

    code = "unknown-mesh"


class SolverFailure(DuocellError):
    """A numerical engine ended in a state that has no meaning for the user."""

    code = "solver-failure"
