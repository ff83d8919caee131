"""A session as a moving picture: the robot in the phantom, the section at its tip, and what its contact presses."""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ..navigate.snapshot import Snapshot
from .course import Course
from .eye import Eye
from .navigation import KPA, extremes, gaps_text, section_half, state_text
from .navigation_scene import backdrop, draw_body, draw_levels, draw_section, draw_targets
from .style import BLUE, GREEN, INK, ORANGE, PALE, QUIET, VERMILION, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SIZE = (960, 470)  # pixels
DOTS = 120.0  # per inch
PACE, PAUSE = 90, 1600  # ms per frame, and for the last
CLEAR = 255  # the palette's entry for what stays as in the frame before
MEANING = (BLUE, ORANGE, VERMILION, GREEN, INK, QUIET, "white")
Watch = Callable[[int, int, str], None]


def animation(found: Course, watch: Watch | None = None) -> bytes:
    """The frames of ``found`` as an animated GIF that starts over; watch(done, total, what) is called before each."""
    with styled():
        stage = _Stage(found)
        images = []
        for k, now in enumerate(found.frames):
            if watch is not None:
                watch(k, len(found.frames), "animation")
            images.append(stage.draw(now))
    return _gif(images)


def _gif(images: list[np.ndarray]) -> bytes:
    """One palette for all frames, without dithering; what stays the same from frame to frame is left out."""
    from PIL import Image

    palette = _palette(images)
    kept = [_indexed(each, palette) for each in images]
    changes = [kept[0], *(np.where(b == a, CLEAR, b).astype(np.uint8) for a, b in pairwise(kept))]
    frames = [Image.fromarray(each, "P") for each in changes]
    for each in frames:
        each.putpalette(palette.getpalette() or [])
    file, durations = BytesIO(), [PACE] * (len(frames) - 1) + [PAUSE]
    how: Any = {"transparency": CLEAR, "disposal": 1, "optimize": False, "loop": 0}
    frames[0].save(file, "GIF", save_all=True, append_images=frames[1:], duration=durations, **how)
    return file.getvalue()


def _indexed(image: np.ndarray, palette: Any) -> np.ndarray:
    """(rows, columns) uint8: the nearest entry of the palette; colours that mean something keep their own."""
    from PIL import Image

    found = np.array(Image.fromarray(image).quantize(palette=palette, dither=Image.Dither.NONE), dtype=np.uint8)
    for k, colour in enumerate(_meaning()):
        found[(image == colour).all(axis=2)] = k
    return found


def _meaning() -> np.ndarray:
    from matplotlib.colors import to_rgb

    return np.round(255.0 * np.array([to_rgb(each) for each in MEANING])).astype(np.uint8)


def _palette(images: list[np.ndarray]) -> Any:
    """255 colours: those that mean something as they are, and the most telling of three frames."""
    from PIL import Image

    meaning = _meaning().ravel().tolist()
    sample = Image.fromarray(np.concatenate([images[0], images[len(images) // 2], images[-1]]))
    found = sample.quantize(CLEAR - len(MEANING), method=Image.Quantize.MEDIANCUT).getpalette() or []
    palette = Image.new("P", (1, 1))
    palette.putpalette((meaning + found)[: 3 * CLEAR] + meaning[:3])
    return palette


class _Stage:
    """The figure, of which only what moves is drawn anew."""

    def __init__(self, found: Course) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self._found = found
        self._figure: Figure = Figure(figsize=(SIZE[0] / DOTS, SIZE[1] / DOTS), dpi=DOTS)
        self._canvas = FigureCanvasAgg(self._figure)
        self._scene = backdrop(found, Eye(), pixel=0.08)
        self._view = self._figure.add_axes((0.005, 0.31, 0.645, 0.61))
        self._cut = self._figure.add_axes((0.665, 0.27, 0.33, 0.65))
        self._line = self._figure.add_axes((0.065, 0.095, 0.925, 0.11))
        self._half = section_half(found)
        self._cursor = self._prepare_line()
        self._scene.show(self._view, smoothing="nearest")
        draw_levels(self._view, self._scene, found)
        self._lasting = len(self._view.lines)
        self._text = self._figure.text(0.012, 0.955, "", size=8.0, va="center")
        self._side = self._figure.text(0.995, 0.955, "", size=7.0, va="center", ha="right")

    def draw(self, now: Snapshot) -> np.ndarray:
        """(rows, columns, 3) uint8."""
        for artist in [*self._view.lines[self._lasting :], *self._view.patches]:
            artist.remove()
        draw_targets(self._view, self._scene, now, self._found)
        draw_body(self._view, self._scene, now, self._found)
        self._cut.clear()
        draw_section(self._cut, now, self._found.scenario, self._half)
        self._cursor.set_xdata([now.time, now.time])
        warned = [each.text for each in now.warnings if each.severity == "limit"]
        self._text.set_text(state_text(now) + (f"   {warned[0]}" if warned else ""))
        self._text.set_color(VERMILION if warned else INK)
        self._side.set_text(gaps_text(now.clearance) if now.exposed > 0.0 and not warned else "")
        self._canvas.draw()
        return np.array(self._canvas.buffer_rgba())[..., :3].copy()

    def _prepare_line(self) -> Any:
        axes, found = self._line, self._found
        limit = KPA * found.scenario.limits.pressure
        axes.plot(*extremes(found.time, KPA * found.pressure), color=BLUE, lw=1.0)
        axes.axhline(limit, color=VERMILION, lw=0.8, ls=(0, (4, 2)))
        axes.set(xlim=(found.time[0], max(found.time[-1], found.time[0] + 1e-3)), ylim=(0.0, None))
        axes.set_ylabel("kPa", size=6.5)
        axes.set_xlabel("s", size=6.5, labelpad=0.0)
        axes.tick_params(labelsize=6.0, pad=1.5)
        axes.set_title("highest contact pressure on soft tissue", size=6.5, weight="normal", color=QUIET, pad=2.0)
        for moment in found.moments:
            axes.axvline(moment.snapshot.time, color=PALE, lw=0.6, zorder=0.5)
        return axes.axvline(found.time[0], color=INK, lw=1.0)
