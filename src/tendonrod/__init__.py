"""Design, plan and drive tendon-driven continuum robots. SI units, angles in radians, world frame unless said
otherwise.
"""

from .body import Segments, TaperedRod
from .errors import InvalidInput, NotConverged, TendonrodError
from .loads import DistributedLoad, LumpedMass, PointLoad
from .motion.follow_leader import plan_follow_leader
from .motion.plan import Plan
from .motion.progression import Motion, progress
from .robot import Robot, load_robot, preset_names
from .section import NotchedTube, PlainRod, Section, StiffnessFactors
from .statics.batch import Batch, solve_batch
from .statics.branches import Branch, follow_branch
from .statics.contact import Contacts
from .statics.derivatives import Jacobian
from .statics.equilibrium import solve
from .statics.shape import Shape, Status
from .tendon import Tendon

__version__ = "0.1.0"
__all__ = [
    "Batch",
    "Branch",
    "Contacts",
    "DistributedLoad",
    "InvalidInput",
    "Jacobian",
    "LumpedMass",
    "Motion",
    "NotConverged",
    "NotchedTube",
    "PlainRod",
    "Plan",
    "PointLoad",
    "Robot",
    "Section",
    "Segments",
    "Shape",
    "Status",
    "StiffnessFactors",
    "TaperedRod",
    "Tendon",
    "TendonrodError",
    "follow_branch",
    "load_robot",
    "plan_follow_leader",
    "preset_names",
    "progress",
    "solve",
    "solve_batch",
]
