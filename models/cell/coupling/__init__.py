"""What ties the bases of arms together: one kind of tie per file, each a few labelled rows of the base placements."""

from duocell.models.cell.coupling.among import among
from duocell.models.cell.coupling.coupling import Coupling, Rows
from duocell.models.cell.coupling.direction import Direction
from duocell.models.cell.coupling.distance import Distance
from duocell.models.cell.coupling.mirror import Mirror
from duocell.models.cell.coupling.rail import Rail
from duocell.models.cell.coupling.rigid import Rigid
from duocell.models.cell.coupling.same_height import SameHeight

__all__ = ["Coupling", "Direction", "Distance", "Mirror", "Rail", "Rigid", "Rows", "SameHeight", "among"]
