"""What an operator asks of the robot, `Jog`, at which speeds, `Rates`, and what the drives then hold, `Posture`."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from math import radians

from ..errors import InvalidInput, finite, within

FASTEST = {"insertion": 20e-3, "rotation": radians(360), "tension": 2.0}  # m/s, rad/s, N/s: beyond it nobody steers
SLOWEST = {"insertion": 1e-5, "rotation": radians(0.1), "tension": 1e-3}
NAMES = tuple(FASTEST)
WORDS = {
    "insertion": ("insertion", "retraction"), "rotation": ("turning +", "turning −"), "tension": ("pulling", "release"),
}  # fmt: skip


@dataclass(frozen=True, kw_only=True, slots=True)
class Jog:
    """Velocities asked for: insertion (m/s, positive into the body), rotation (rad/s), tension (N/s, of every tendon).

    Raises `InvalidInput` beyond 20 mm/s, 360 deg/s or 2 N/s.
    """

    insertion: float = 0.0
    rotation: float = 0.0
    tension: float = 0.0

    def __post_init__(self) -> None:
        for name in NAMES:
            fastest = FASTEST[name]
            object.__setattr__(self, name, within(name, getattr(self, name), -fastest, fastest))

    @property
    def is_still(self) -> bool:
        """Whether nothing shall move."""
        return self.insertion == 0.0 and self.rotation == 0.0 and self.tension == 0.0

    def words(self, names: Collection[str] = NAMES) -> str:
        """What it moves of ``names``: "insertion", "retraction and pulling"; "motion" where it is none of them."""
        asked = {name: getattr(self, name) for name in NAMES if name in names}
        return " and ".join(WORDS[name][value < 0.0] for name, value in asked.items() if value != 0.0) or "motion"


@dataclass(frozen=True, kw_only=True, slots=True)
class Rates:
    """Speeds at full deflection of a key or stick: insertion m/s, rotation rad/s, tension N/s.

    Raises `InvalidInput` outside `allowed`.
    """

    insertion: float = 3e-3
    rotation: float = radians(30)
    tension: float = 0.1

    def __post_init__(self) -> None:
        for name, (low, high) in self.allowed().items():
            object.__setattr__(self, name, within(name, getattr(self, name), low, high))

    @staticmethod
    def allowed() -> dict[str, tuple[float, float]]:
        """Name -> (lowest, highest) rate, SI."""
        return {name: (SLOWEST[name], FASTEST[name]) for name in NAMES}

    def limited(self, fastest: Jog) -> Rates:
        """No faster than ``fastest``, as far as that is allowed."""
        both = {name: min(getattr(self, name), getattr(fastest, name)) for name in NAMES}
        return Rates(**{name: max(SLOWEST[name], rate) for name, rate in both.items()})

    def jog(self, insertion: float = 0.0, rotation: float = 0.0, tension: float = 0.0) -> Jog:
        """The jog of deflections from -1 to 1. Raises `InvalidInput`."""
        shares = {"insertion": insertion, "rotation": rotation, "tension": tension}
        return Jog(**{name: within(name, share, -1.0, 1.0) * getattr(self, name) for name, share in shares.items()})


@dataclass(frozen=True, kw_only=True, slots=True)
class Posture:
    """What the drives hold: insertion (share of the length, 0 to 1), rotation (rad), tension (n_tendons,) N.

    rotation: of the section frame at the outer tube's exit; 0 where tension bends the robot ventrally.
    """

    insertion: float = 0.0
    rotation: float = 0.0
    tension: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        within("insertion", self.insertion, 0.0, 1.0)
        finite("rotation", self.rotation)
        if not isinstance(self.tension, tuple):
            raise InvalidInput("tension", self.tension, "a tuple of one number per tendon")

    def towards(self, other: Posture, share: float) -> Posture:
        """The posture at ``share`` of the straight way to ``other``, itself at share 1."""
        if share >= 1.0:
            return other
        return Posture(
            insertion=self.insertion + share * (other.insertion - self.insertion),
            rotation=self.rotation + share * (other.rotation - self.rotation),
            tension=tuple(a + share * (b - a) for a, b in zip(self.tension, other.tension, strict=True)),
        )
