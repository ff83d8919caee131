"""A short session, recorded, with what a page must tell: tension, a rest, insertion to the front, a turn."""

from math import radians

from tendonrod.navigate.commands import Jog
from tendonrod.navigate.record import SessionRecord
from tendonrod.navigate.scenario import load_scenario
from tendonrod.navigate.session import Session
from tendonrod.plot.style import new_figure

STEP = 0.25  # s
PULL, REST, IN, TURN = Jog(tension=0.25), Jog(), Jog(insertion=6e-3), Jog(rotation=radians(-20))
SHORT = ((PULL, 6), (IN, 8))  # touches nothing, reaches nothing
MOVES = ((PULL, 14), (REST, 6), (IN, 36), (TURN, 2))


def scene():
    """ExoNav 1 in the printed phantom, L2 and L1, from a tube that lets it wind round to the front."""
    tube = {"height": 0.0, "offset": 0.0, "depth": 5.6e-3, "tilt": radians(28), "lean": 0.0}
    return load_scenario("exonav-1", "printed", levels="L1-L2", tube=tube)


def recorded(path, moves=MOVES):
    """(scenario, snapshots) of the session, recorded at ``path``."""
    session = Session(scene(), record=SessionRecord(path))
    found = [session.snapshot]
    found += [session.step(jog, STEP) for jog, count in moves for _ in range(count)]
    session.close()
    return session.scenario, found


def plain_figures(patch):
    """Empty figures and movie in a session's page: the real ones take seconds and have their own tests."""
    patch.setattr("tendonrod.plot.navigation_movie.animation", lambda found, watch=None: b"GIF89a")
    for name in ("scenes", "map", "lines"):
        patch.setattr(f"tendonrod.plot.navigation.{name}_figure", lambda found: new_figure(1.0))
