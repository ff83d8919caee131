"""Surfaces that a robot may touch, given as signed distance: positive in the free space, world frame, metres.

A surface is any object with ``distance(points (n, 3)) -> (d (n,), gradient (n, 3))``; the gradient has unit length and
points into the free space. `Surface` adds ``curvature(points) -> (n, 3, 3)``, the Hessian of d in 1/m, by differences
of the gradient where a shape gives no closed form. `as_surface` checks an object of the caller's own.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from .errors import Fact, InvalidInput, numbers, positive, vector

STEP = 1e-6  # m, half the base of the differences of a gradient
# Uniform cubic B-splines: (1, t, t^2, t^3) @ BASIS[order] are the weights, or derivatives, of four coefficients.
BASIS = np.array([[1, 4, 1, 0], [-3, 0, 3, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]) / 6.0
BASIS = np.array([BASIS, np.diag([1, 2, 3], -1).T @ BASIS, np.diag([2, 6], -2).T @ BASIS])
NEAREST = 1e-6  # share of its radius within which the centre or axis of a round shape has no normal of its own
STEEPEST = 3.0  # change of a gridded distance per distance between nodes; 1 for a true one, 2 between two voxel masks
PROBES = ((0.0, 0.0, 0.0), (0.0, 1e-3, 2e-3))  # m, near the robot's base


class Surface(ABC):
    """A signed distance with its gradient, and the Hessian by central differences."""

    @abstractmethod
    def distance(self, points) -> tuple[np.ndarray, np.ndarray]:
        """Signed distance (n,) m of ``points`` (n, 3) m, and its gradient (n, 3)."""

    def curvature(self, points) -> np.ndarray:
        """Hessian (n, 3, 3) of the distance at ``points`` (n, 3), 1/m."""
        points = np.asarray(points, dtype=float)
        shifts = STEP * np.concatenate([np.eye(3), -np.eye(3)])
        gradient = self.distance((points + shifts[:, None]).reshape(-1, 3))[1].reshape(2, 3, *points.shape)
        H = np.moveaxis(gradient[0] - gradient[1], 0, 2) / (2.0 * STEP)
        return 0.5 * (H + H.transpose(0, 2, 1))


@dataclass(frozen=True, kw_only=True, eq=False)
class Plane(Surface):
    """The half space on the side of ``normal`` (3,), of any length, of the plane through ``point`` (3,) m."""

    point: Any  # (3,) numbers; an array once made
    normal: Any  # (3,) numbers; an array once made

    def __post_init__(self) -> None:
        _keep(self, point=vector("point", self.point, 3), normal=_direction("normal", self.normal))

    def distance(self, points) -> tuple[np.ndarray, np.ndarray]:
        """Signed distance (n,) and gradient (n, 3) at ``points`` (n, 3)."""
        d = (np.asarray(points, dtype=float) - self.point) @ self.normal
        return d, np.repeat(self.normal[None], d.size, axis=0)

    def curvature(self, points) -> np.ndarray:
        """Zeros (n, 3, 3)."""
        return np.zeros((len(points), 3, 3))


class _Round(Surface):
    """Distance from a centre or an axis, less the radius; ``_across`` projects on the directions that count.

    At the centre or on the axis itself, where the normal is undefined, one fixed normal stands for all.
    """

    side: ClassVar[float]  # +1 where the robot is outside, -1 where it is inside
    radius: float
    _origin: np.ndarray
    _across: np.ndarray
    _spare: np.ndarray

    def _set(self, origin: np.ndarray, across: np.ndarray, spare: np.ndarray) -> None:
        _keep(self, radius=positive("radius", self.radius), _origin=origin, _across=across, _spare=spare)

    def _radial(self, points) -> tuple[np.ndarray, np.ndarray]:
        """Distance from the centre or axis, and the direction away from it."""
        arm = (np.asarray(points, dtype=float) - self._origin) @ self._across
        rho = np.sqrt(np.einsum("ij,ij->i", arm, arm))
        at_centre = rho < 1e-9 * self.radius  # where rounding would decide on the direction
        if at_centre.any():
            arm = np.where(at_centre[:, None], self._spare, arm)
        return rho, arm / np.where(at_centre, 1.0, rho)[:, None]

    def distance(self, points) -> tuple[np.ndarray, np.ndarray]:
        """Signed distance (n,) and gradient (n, 3) at ``points`` (n, 3)."""
        rho, outward = self._radial(points)
        return self.side * (rho - self.radius), self.side * outward

    def curvature(self, points) -> np.ndarray:
        """Hessian (n, 3, 3); bounded at the centre or axis, where the true one is not."""
        rho, outward = self._radial(points)
        H = self._across - outward[:, :, None] * outward[:, None, :]
        return H * (self.side / np.maximum(rho, NEAREST * self.radius))[:, None, None]


@dataclass(frozen=True, kw_only=True, eq=False)
class _AroundAxis(_Round):
    point: Any  # (3,) numbers; an array once made
    axis: Any  # (3,) numbers; an array once made
    radius: float

    def __post_init__(self) -> None:
        point, axis = vector("point", self.point, 3), _direction("axis", self.axis)
        _keep(self, point=point, axis=axis)
        spare = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        self._set(point, np.eye(3) - np.outer(axis, axis), spare / np.linalg.norm(spare))


@dataclass(frozen=True, kw_only=True, eq=False)
class _AroundCenter(_Round):
    center: Any  # (3,) numbers; an array once made
    radius: float

    def __post_init__(self) -> None:
        center = vector("center", self.center, 3)
        _keep(self, center=center)
        self._set(center, np.eye(3), np.array([1.0, 0.0, 0.0]))


class Tube(_AroundAxis):
    """The inside of an endless cylinder of ``radius`` m around the line through ``point`` (3,) m along ``axis``."""

    side = -1.0


class Cylinder(_AroundAxis):
    """The outside of an endless cylinder of ``radius`` m around the line through ``point`` (3,) m along ``axis``."""

    side = 1.0


class Sphere(_AroundCenter):
    """The outside of a sphere of ``radius`` m around ``center`` (3,) m."""

    side = 1.0


class Cavity(_AroundCenter):
    """The inside of a sphere of ``radius`` m around ``center`` (3,) m."""

    side = -1.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Walls(Surface):
    """Several ``surfaces`` at once: the distance of the nearest one, with its gradient and curvature."""

    surfaces: Sequence[Any]

    def __post_init__(self) -> None:
        if not isinstance(self.surfaces, (list, tuple)) or not self.surfaces:
            raise InvalidInput("surfaces", self.surfaces, "a list of one or more surfaces")
        checked = tuple(as_surface(each, name=f"surfaces[{i}]") for i, each in enumerate(self.surfaces))
        object.__setattr__(self, "surfaces", checked)

    def distance(self, points) -> tuple[np.ndarray, np.ndarray]:
        """Signed distance (n,) and gradient (n, 3) at ``points`` (n, 3)."""
        d, gradient = (np.array(each) for each in zip(*[each.distance(points) for each in self.surfaces], strict=True))
        nearest, row = np.argmin(d, axis=0), np.arange(d.shape[1])
        return d[nearest, row], gradient[nearest, row]

    def curvature(self, points) -> np.ndarray:
        """Hessian (n, 3, 3) of the nearest surface's distance."""
        nearest = np.argmin([each.distance(points)[0] for each in self.surfaces], axis=0)
        return np.array([each.curvature(points) for each in self.surfaces])[nearest, np.arange(nearest.size)]


@dataclass(frozen=True, kw_only=True, eq=False)
class DistanceGrid(Surface):
    """Signed distances ``values`` (i, j, k) m at the nodes ``origin`` + ``spacing`` * (i, j, k), by cubic splines.

    ``spacing`` is one number or three, m; at least 4 nodes per axis. The spline goes through the values, is twice
    continuously differentiable and exact for cubic polynomials up to the border (not-a-knot ends). The gradient is its
    exact derivative, so its length differs from 1 by the error of the interpolation. Raises `InvalidInput`, also for
    points outside the grid.
    """

    origin: Any
    spacing: Any
    values: Any
    _coefficients: np.ndarray = field(init=False, repr=False)
    _strides: np.ndarray = field(init=False, repr=False)
    _around: np.ndarray = field(init=False, repr=False)
    _basis: dict[int, np.ndarray] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        spacing, origin = _spacing(self.spacing), vector("origin", self.origin, 3)
        values = _grid_values(self.values, spacing)
        _keep(self, origin=origin, spacing=spacing, values=values)
        coefficients = values
        for axis, size in enumerate(values.shape):
            along = np.tensordot(_to_spline(size), coefficients, axes=(1, axis))
            coefficients = np.moveaxis(along, 0, axis)
        _, m, n = coefficients.shape
        strides = np.array([m * n, n, 1])
        around = np.indices((4, 4, 4)).reshape(3, 64).T @ strides
        scaled = [[BASIS[order] / h**order for order in range(3)] for h in spacing]
        _keep(self, _basis={order: np.array([np.hstack(each[: order + 1]) for each in scaled]) for order in (1, 2)})
        _keep(self, _coefficients=np.ascontiguousarray(coefficients).ravel(), _strides=strides, _around=around)

    def distance(self, points) -> tuple[np.ndarray, np.ndarray]:
        """Signed distance (n,) and gradient (n, 3) at ``points`` (n, 3)."""
        D = self._derivatives(points, 1)
        return D[:, 0, 0, 0], np.stack([D[:, 1, 0, 0], D[:, 0, 1, 0], D[:, 0, 0, 1]], axis=1)

    def curvature(self, points) -> np.ndarray:
        """Hessian (n, 3, 3) of the spline, continuous."""
        D = self._derivatives(points, 2)
        xy, yz, xz = D[:, 1, 1, 0], D[:, 0, 1, 1], D[:, 1, 0, 1]
        rows = [D[:, 2, 0, 0], xy, xz, xy, D[:, 0, 2, 0], yz, xz, yz, D[:, 0, 0, 2]]
        return np.stack(rows, axis=1).reshape(-1, 3, 3)

    def _derivatives(self, points, order: int) -> np.ndarray:
        """D[:, a, b, c] = d^(a+b+c) d / dx^a dy^b dz^c at ``points``, each of a, b, c up to ``order``."""
        cell, t = self._located(np.asarray(points, dtype=float))
        powers = np.stack([np.ones_like(t), t, t * t, t * t * t], axis=2).transpose(1, 0, 2)
        x, y, z = (powers @ self._basis[order]).reshape(3, -1, order + 1, 4)  # weights and their derivatives
        D = self._coefficients.take((cell @ self._strides)[:, None] + self._around)
        D = (D.reshape(-1, 16, 4) @ z.transpose(0, 2, 1)).reshape(-1, 4, 4, order + 1)
        D = (y[:, None] @ D).reshape(-1, 4, (order + 1) ** 2)
        return (x @ D).reshape(-1, order + 1, order + 1, order + 1)

    def _located(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The cell (n, 3) of each point and its place in it, 0 to 1."""
        place, last = (points - self.origin) / self.spacing, np.array(self.values.shape) - 1
        inside = (place >= -1e-9) & (place <= last + 1e-9)
        if not inside.all():
            i = int(np.argmin(inside.all(axis=1)))
            corners = zip("xyz", self.origin, self.origin + last * self.spacing, strict=True)
            box = ", ".join(f"{name} from {low:.6g} to {high:.6g}" for name, low, high in corners)
            raise InvalidInput(f"points[{i}]", points[i], f"inside the distance grid, {box} m")
        cell = np.clip(place.astype(int), 0, last - 1)
        return cell, place - cell


class _Foreign(Surface):
    """A caller's own surface, every answer of which is checked."""

    def __init__(self, name: str, surface: Any) -> None:
        self.name, self.surface = name, surface

    def distance(self, points) -> tuple[np.ndarray, np.ndarray]:
        points = np.asarray(points, dtype=float)
        answer = self.surface.distance(points)
        if not isinstance(answer, tuple) or len(answer) != 2:
            raise InvalidInput(f"{self.name}.distance(points)", answer, "a pair: distances (n,), gradients (n, 3)")
        d = self._checked("distance(points)[0]", answer[0], points.shape[:1])
        gradient = self._checked("distance(points)[1]", answer[1], points.shape)
        length = np.sqrt(np.einsum("ij,ij->i", gradient, gradient))
        if np.any(np.abs(length - 1.0) > 0.5):
            raise InvalidInput(f"{self.name}.distance(points)[1]", gradient, "gradients of unit length")
        return d, gradient

    def curvature(self, points) -> np.ndarray:
        if not callable(getattr(self.surface, "curvature", None)):
            return super().curvature(points)
        points = np.asarray(points, dtype=float)
        return self._checked("curvature(points)", self.surface.curvature(points), (*points.shape, 3))

    def _checked(self, what: str, value: object, shape: tuple[int, ...]) -> np.ndarray:
        try:
            array = np.asarray(value, dtype=float)
        except (TypeError, ValueError):
            array = None
        if array is None or array.shape != shape or not np.isfinite(array).all():
            raise InvalidInput(f"{self.name}.{what}", value, f"finite numbers of shape {shape}")
        return array


def as_surface(value: Any, points=PROBES, name: str = "surface") -> Surface:
    """``value`` as a `Surface`, ready for use; shapes of this module are returned as they are.

    Any other object, a `Surface` of the caller's own too, is asked for its distance at ``points`` (n, 3) m, and every
    later answer is checked too. Raises `InvalidInput` where it has no method ``distance(points)`` or answers with wrong
    shapes, lengths or NaN.
    """
    if isinstance(value, (Plane, _Round, Walls, DistanceGrid, _Foreign)):
        return value
    if isinstance(value, type) or not callable(getattr(value, "distance", None)):
        raise InvalidInput(name, value, "a surface: an object with a method distance(points) -> (distance, gradient)")
    surface = _Foreign(name, value)
    surface.distance(np.array(points, dtype=float))
    return surface


def _keep(value: object, **fields: Any) -> None:
    """Sets fields of a frozen object, arrays read-only."""
    for name, each in fields.items():
        if isinstance(each, np.ndarray):
            each.setflags(write=False)
        object.__setattr__(value, name, each)


def _direction(field: str, value: object) -> np.ndarray:
    direction = vector(field, value, 3)
    length = np.linalg.norm(direction)
    if length == 0.0:
        raise InvalidInput(field, value, "a vector of three finite numbers, not all zero")
    return direction / length


def _spacing(value: object) -> np.ndarray:
    if isinstance(value, (list, tuple, np.ndarray)) and np.ndim(value) > 0:
        return np.array([positive("spacing", each) for each in vector("spacing", value, 3).tolist()])
    return np.full(3, positive("spacing", value))


def _grid_values(value: object, spacing: np.ndarray) -> np.ndarray:
    values = numbers("values", value, ndim=3)
    if min(values.shape) < 4:
        raise InvalidInput("values", Fact(f"array of shape {values.shape}"), "at least 4 nodes along each axis")
    steepest = max(np.abs(np.diff(values, axis=a)).max() / spacing[a] for a in range(3))
    if steepest > STEEPEST:
        says = f"changes by {steepest:.3g} times the distance between nodes"
        raise InvalidInput("values", Fact(says), "distances in metres, which change by 1 times it at most")
    return values


def _to_spline(n: int) -> np.ndarray:
    """(n + 2, n) from values at n nodes to coefficients of uniform cubic B-splines, with not-a-knot ends."""
    A = np.zeros((n + 2, n + 2))
    for i in range(3):
        A[np.arange(1, n + 1), np.arange(n) + i] = (1 / 6, 4 / 6, 1 / 6)[i]
    A[0, :5] = A[-1, -5:] = 1.0, -4.0, 6.0, -4.0, 1.0  # no jump of the third derivative
    return np.linalg.inv(A)[:, 1:-1]
