"""What ties the bases of arms together: one kind of tie per file, each a few labelled rows of the base placements."""

from models.coupling.among import among
from models.coupling.coupling import Coupling, Rows
from models.coupling.direction import Direction
from models.coupling.distance import Distance
from models.coupling.mirror import Mirror
from models.coupling.rail import Rail
from models.coupling.same_height import SameHeight

__all__ = ["Coupling", "Direction", "Distance", "Mirror", "Rail", "Rows", "SameHeight", "among"]
