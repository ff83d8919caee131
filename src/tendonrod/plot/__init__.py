"""Figures of shapes, motions and plans, in one style. Lengths in mm, tensions in N; matplotlib comes at first use."""

from .motions import motion_figure, plan_figure
from .shapes import shape_figure
from .style import save

__all__ = ["motion_figure", "plan_figure", "save", "shape_figure"]
