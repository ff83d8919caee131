"""Plane views along the world's axes. x points up, z along the tube, so y points to the left of an eye at the tip."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .style import labelled

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True, kw_only=True)
class View:
    """right, up: the world's axes, signed, that point so in the picture, such as "-y"; their cross product, towards the
    eye, must be where ``title`` says that it is.
    """

    title: str
    right: str
    up: str

    @property
    def eye(self) -> np.ndarray:
        """(3,) direction from the body to the eye, world frame."""
        return np.cross(_direction(self.right), _direction(self.up))

    def project(self, path: np.ndarray) -> np.ndarray:
        """(k, 2) world coordinates across and up of a path (k, 3); `prepare` lets the axes run the right way."""
        return path[:, ["xyz".index(self.right[1]), "xyz".index(self.up[1])]]

    def prepare(self, axes: Axes) -> Axes:
        """Name both axes and turn those round that point against their world axis; idempotent, as shared axes need."""
        axes.xaxis.set_inverted(self.right[0] == "-")
        axes.yaxis.set_inverted(self.up[0] == "-")
        return labelled(axes, f"{self.right[1]} (mm)", f"{self.up[1]} (mm)")


SIDE = View(title="seen from the side", right="+z", up="+x")
ABOVE = View(title="seen from above", right="+z", up="-y")
TIP = View(title="seen from the tip", right="-y", up="+x")


def _direction(signed: str) -> np.ndarray:
    return (1.0 if signed[0] == "+" else -1.0) * np.eye(3)["xyz".index(signed[1])]
