"""What ties the bases of arms together: one kind of tie per file, each a few labelled rows of the base placements."""

from models.cell.coupling.among import among
from models.cell.coupling.coupling import Coupling, Rows
from models.cell.coupling.direction import Direction
from models.cell.coupling.distance import Distance
from models.cell.coupling.mirror import Mirror
from models.cell.coupling.rail import Rail
from models.cell.coupling.same_height import SameHeight

__all__ = ["Coupling", "Direction", "Distance", "Mirror", "Rail", "Rows", "SameHeight", "among"]
