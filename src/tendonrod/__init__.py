"""Design, plan and drive tendon-driven continuum robots. SI units, angles in radians, world frame unless said
otherwise.

What is offered here is imported when it is first asked for: the command line can then answer Ctrl-C from its first
line on, while NumPy is still being loaded.
"""

TYPE_CHECKING = False  # as type checkers know it; typing itself takes 10 ms to import
if TYPE_CHECKING:
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
_OFFERED_BY = {
    "body": ("Segments", "TaperedRod"),
    "errors": ("InvalidInput", "NotConverged", "TendonrodError"),
    "loads": ("DistributedLoad", "LumpedMass", "PointLoad"),
    "motion.follow_leader": ("plan_follow_leader",),
    "motion.plan": ("Plan",),
    "motion.progression": ("Motion", "progress"),
    "robot": ("Robot", "load_robot", "preset_names"),
    "section": ("NotchedTube", "PlainRod", "Section", "StiffnessFactors"),
    "statics.batch": ("Batch", "solve_batch"),
    "statics.branches": ("Branch", "follow_branch"),
    "statics.contact": ("Contacts",),
    "statics.derivatives": ("Jacobian",),
    "statics.equilibrium": ("solve",),
    "statics.shape": ("Shape", "Status"),
    "tendon": ("Tendon",),
}
_HOME = {name: module for module, names in _OFFERED_BY.items() for name in names}


def __getattr__(name: str):
    """What `__all__` names, and the package's modules, which need no import of their own."""
    from importlib import import_module
    from importlib.util import find_spec

    if name in _HOME:
        found = getattr(import_module(f".{_HOME[name]}", __name__), name)
        globals()[name] = found
        return found
    if not name.startswith("_") and find_spec(f"{__name__}.{name}") is not None:
        return import_module(f".{name}", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
