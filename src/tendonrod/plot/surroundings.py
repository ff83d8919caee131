"""What surrounds a body and acts on it, drawn: surfaces near it, forces of contacts and point loads, masses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..loads import LumpedMass, PointLoad
from ..statics.contact import Contacts
from ..statics.problem import Request, problem_of
from ..statics.shape import Shape
from .style import INK, MM, PURPLE, QUIET, VERMILION
from .walls import near_walls, silhouette

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LONGEST = 0.17  # of the body's size: the longest arrow
SHORTEST = 0.25  # of the longest arrow: in a view, what is shorter is a dot
STRETCH = 1.0 / 8.0  # of the exposed length: contacts within are drawn as one arrow
GAP = 0.04  # of the exposed length: contacts farther apart are drawn apart
WALL = "#8fa3b8"
_Project = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, kw_only=True)
class Forces:
    """Arrows of one kind: name and colour, start (k, 3) and end (k, 3) in mm, and the largest force in N."""

    name: str
    colour: str
    start: np.ndarray
    end: np.ndarray
    largest: float


@dataclass(frozen=True, kw_only=True)
class Surroundings:
    """walls: grids (m, n, 3) in mm. masses (k, 3) mm."""

    walls: list[np.ndarray]
    forces: list[Forces]
    masses: np.ndarray

    @property
    def paths(self) -> list[np.ndarray]:
        """Points (k, 3) that a drawing must have room for, mm."""
        return [*self.walls, *(each for found in self.forces for each in (found.start, found.end)), self.masses]


def surroundings(shapes: Sequence[Shape]) -> Surroundings:
    """Of one shape or several; a surface that they share is drawn once, around all of them."""
    requests = [problem_of(shape._solution).request for shape in shapes]
    size = MM * max(float(np.ptp(np.concatenate([shape.centerline for shape in shapes]), axis=0).max()), 1e-6)
    touching, pushing, masses = [], [], []
    for shape, request in zip(shapes, requests, strict=True):
        touching += [] if shape.contacts is None else _pressed(shape.contacts, shape.length)
        pushing += _pushed(shape, request)
        places = [_place(shape, load) for load in request.loads if isinstance(load, LumpedMass)]
        masses += [MM * place[0] for place in places if place is not None]
    forces = [_arrows("contact force", VERMILION, touching, size), _arrows("point load", PURPLE, pushing, size)]
    return Surroundings(
        walls=walls_around(shapes),
        forces=[each for each in forces if each is not None],
        masses=np.reshape(masses, (-1, 3)),
    )


def walls_around(shapes: Sequence[Shape]) -> list[np.ndarray]:
    """Grids (m, n, 3) in mm of the surfaces near the shapes."""
    bodies = np.concatenate([shape.centerline for shape in shapes])
    surfaces = [problem_of(shape._solution).request.surface for shape in shapes]
    return [
        MM * grid for surface in {id(each): each for each in surfaces}.values() for grid in near_walls(surface, bodies)
    ]


def draw_in_space(axes: Any, around: Surroundings) -> None:
    """Into 3D axes whose limits and view are set."""
    from mpl_toolkits.mplot3d import proj3d

    draw_walls(axes, around.walls)

    def project(points: np.ndarray) -> np.ndarray:
        x, y, _ = proj3d.proj_transform(*points.T, axes.get_proj())  # pyright: ignore[reportCallIssue]
        return np.stack([x, y], axis=-1)

    _draw_forces(axes, around, project)
    axes.plot(*around.masses.T, ls="", marker="s", ms=4.5, color=INK, zorder=4, clip_on=False)


def draw_walls(axes: Any, walls: Sequence[np.ndarray]) -> None:
    """Grids (m, n, 3) in mm into 3D axes, translucent, behind every line whatever their depth."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    axes.computed_zorder = axes.computed_zorder and not walls
    for grid in walls:
        facets = Poly3DCollection(_facets(grid), facecolor=WALL, alpha=0.13, edgecolor="none", zorder=0.5)
        facets.set_clip_on(False)
        axes.add_collection3d(facets, autolim=False)
        for line in _wires(grid):
            axes.plot(*line.T, color=WALL, lw=0.35, alpha=0.6, zorder=0.6, clip_on=False)


def draw_in_view(axes: Axes, around: Surroundings, project: _Project) -> None:
    """Into plane axes; ``project`` maps (k, 3) to (k, 2)."""
    from matplotlib.patches import Polygon

    for grid in around.walls:
        outline = silhouette(project(grid.reshape(-1, 3)).reshape(*grid.shape[:2], 2))
        axes.add_patch(Polygon(outline, facecolor=WALL, alpha=0.2, edgecolor="none", zorder=0.5))
        axes.add_patch(Polygon(outline, fill=False, edgecolor=WALL, lw=0.7, zorder=0.6))
    _draw_forces(axes, around, project)
    for found in around.forces:
        axes.update_datalim(project(np.concatenate([found.start, found.end])))
    axes.plot(*project(around.masses).T, ls="", marker="s", ms=4.0, color=INK, zorder=4)
    axes.autoscale_view()


def legend_handles(around: Surroundings) -> list[Any]:
    """One for each kind of thing there is."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = []
    if around.walls:
        handles.append(Patch(facecolor=WALL, alpha=0.4, edgecolor=QUIET, lw=0.5, label="surface"))
    for found in around.forces:
        name = f"{found.name}, {'' if len(found.start) == 1 else 'longest '}{_force(found.largest)}"
        handles.append(Line2D([], [], color=found.colour, lw=1.3, marker=">", markevery=(1, 2), ms=4.5, label=name))
    if len(around.masses):
        handles.append(Line2D([], [], ls="", marker="s", ms=4.0, color=INK, label="mass"))
    return handles


def _pressed(contacts: Contacts, length: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """(point, force) of each stretch of contact."""
    groups: list[list[int]] = []
    for k, s in enumerate(contacts.s):
        last = groups[-1] if groups else None
        if last and s - contacts.s[last[-1]] < GAP * length and s - contacts.s[last[0]] < STRETCH * length:
            last.append(k)
        else:
            groups.append([k])
    found = []
    for group in groups:
        share = contacts.force[group] / contacts.force[group].sum()
        found.append((share @ contacts.point[group], contacts.force[group] @ contacts.normal[group]))
    return found


def _pushed(shape: Shape, request: Request) -> list[tuple[np.ndarray, np.ndarray]]:
    """(point, force) of each point load and of the tip force, world frame."""
    found = [(shape.tip, np.array(request.tip_force))] if any(request.tip_force) else []
    for load in request.loads:
        if isinstance(load, PointLoad) and any(load.force) and (place := _place(shape, load)) is not None:
            point, rotation = place
            found.append((point, rotation @ load.force if load.frame == "body" else np.array(load.force)))
    return found


def _place(shape: Shape, load: PointLoad | LumpedMass) -> tuple[np.ndarray, np.ndarray] | None:
    """Where a load acts, m, and the section's frame; None inside the outer tube."""
    base = shape.robot.length_na - shape.length
    s = shape.length if load.at is None else load.at - base
    if s < 0.0:
        return None
    there = shape.at([min(s, shape.length)])
    return there.centerline[0] + there.rotation[0] @ load.offset, there.rotation[0]


def _arrows(name: str, colour: str, found: list[tuple[np.ndarray, np.ndarray]], size: float) -> Forces | None:
    """Arrows whose longest is a share of ``size`` (mm)."""
    if not found:
        return None
    start, force = MM * np.array([point for point, _ in found]), np.array([force for _, force in found])
    largest = float(np.linalg.norm(force, axis=1).max())
    return Forces(name=name, colour=colour, start=start, end=start + LONGEST * size / largest * force, largest=largest)


def _draw_forces(axes: Any, around: Surroundings, project: _Project) -> None:
    """Arrows; a dot where one points at the eye."""
    from matplotlib.lines import Line2D

    style = {"arrowstyle": "-|>,head_length=0.42,head_width=0.17", "lw": 1.1, "shrinkA": 0.0, "shrinkB": 0.0}
    for found in around.forces:
        start, end = project(found.start), project(found.end)
        longest = np.linalg.norm(found.end - found.start, axis=1).max() * _shrinking(project)
        for a, b in zip(start, end, strict=True):
            if np.linalg.norm(b - a) < SHORTEST * longest:
                axes.add_line(Line2D(*a[:, None], marker="o", ms=3.6, color=found.colour, zorder=5, clip_on=False))
            else:
                props = {**style, "color": found.colour}
                axes.annotate("", b, a, arrowprops=props, annotation_clip=False, zorder=5)


def _shrinking(project: _Project) -> float:
    """The length in the picture, per length in space, of what lies across the line of sight."""
    axes = project(np.concatenate([np.zeros((1, 3)), np.eye(3)]))
    return float(np.linalg.svd(axes[1:] - axes[0], compute_uv=False)[0])


def _facets(grid: np.ndarray) -> np.ndarray:
    """(q, 4, 3) quadrangles of a grid (m, n, 3)."""
    corners = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    return np.stack(corners, axis=2).reshape(-1, 4, 3)


def _wires(grid: np.ndarray) -> list[np.ndarray]:
    """Some lines of a grid along both of its directions, its borders among them."""
    m, n = grid.shape[:2]
    return [*grid[:: max(1, (m - 1) // 12)], *np.moveaxis(grid, 1, 0)[:: max(1, (n - 1) // 6)]]


def _force(newtons: float) -> str:
    return (
        f"{newtons:.3g} N" if newtons >= 0.1 else f"{1e3 * newtons:.3g} mN" if newtons >= 1e-4 else f"{newtons:.2g} N"
    )
