"""Axes to draw on: given ones or new ones, with their colours, scales and legends."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib import colors
from matplotlib.axes import Axes
from matplotlib.legend import Legend
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from .._results import Floats

# Colours of palpate's reports: the palette of Okabe and Ito for colour-blind readers, and lighter ones for a dark background.
_LIGHT_GROUND = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")
_DARK_GROUND = ("#4090d8", "#ff863d", "#2fc79a", "#e39ac4", "#9edaff", "#ffc857")
_SIZE = (4.5, 3.0)
_FAR_APART = 10.0
_MOST_COLUMNS = 8


class Canvas:
    """Axes with the colours that are seen on them.

    Colours follow the axes: the ink is that of their labels, whatever the style sheet, and series have lighter colours where the ink is light.
    """

    def __init__(self, ax: Axes | None, size: tuple[float, float] = _SIZE) -> None:
        self.ax = _new_axes(size) if ax is None else ax
        if not isinstance(self.ax, Axes):
            raise TypeError(f"`ax` is of the type {type(ax).__name__}; it must be an Axes of Matplotlib, or None for new ones")
        self.ink = colors.to_rgb(self.ax.xaxis.label.get_color())
        self.is_dark = float(np.dot(self.ink, (0.2126, 0.7152, 0.0722))) > 0.5
        self.marker_size = 0.6 * float(mpl.rcParams["lines.markersize"])

    @classmethod
    def of_plane(cls, ax: Axes | None, length_m: float, width_m: float, *, bar: bool = False) -> Canvas:
        """Axes for a plane, drawn to scale; with room for a colour bar."""
        beside = 1.5 if bar else 0.8
        height = (_SIZE[0] - beside) * width_m / length_m + 0.9
        return cls(ax, (_SIZE[0], min(max(height, 1.6), 2 * _SIZE[1])))

    @property
    def ground(self) -> Any:
        """Colour behind the data."""
        return self.ax.get_facecolor()

    @property
    def quiet(self) -> Any:
        """Colour of what stands back behind the data."""
        return (*self.ink, 0.5)

    def colour(self, index: int) -> str:
        """The colour of a series."""
        series = _DARK_GROUND if self.is_dark else _LIGHT_GROUND
        return series[index % len(series)]

    def dashes(self, index: int) -> str:
        """The line style of a series: solid, and dashed where its colour is there for the second time."""
        return ("-", "--", ":")[index // len(_LIGHT_GROUND) % 3]

    def labels(self, x: str, y: str) -> None:
        self.ax.set_xlabel(x)
        self.ax.set_ylabel(y)

    def along(self, length_m: float) -> None:
        """Limits of the horizontal axis: the ends of the surface."""
        self.ax.set_xlim(0, 1e3 * length_m)

    def scale_by(self, values: Any, *, least: float | None = None) -> None:
        """A logarithmic vertical axis where values are far apart and positive; else one from 0."""
        values = np.ravel(np.asarray(values, dtype=float))
        values = values[np.isfinite(values)]
        positive = values[values > 0]
        if least is not None:
            positive = positive[positive >= least]
        if positive.size and (least is not None or positive.size == values.size) and positive.max() >= _FAR_APART * positive.min():
            self.logarithmic(self.ax.yaxis)
        else:
            self.ax.set_ylim(bottom=0)

    def logarithmic(self, axis: Any) -> None:
        """A logarithmic axis with plain numbers as ticks."""
        name = axis.axis_name
        (self.ax.set_xscale if name == "x" else self.ax.set_yscale)("log")
        low, high = sorted(self.ax.get_xlim() if name == "x" else self.ax.get_ylim())
        axis.set_major_locator(_plain_ticks(low, high))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())

    def to_scale(self, length_m: float, width_m: float) -> None:
        """The outline of a plane, a millimetre as long both ways."""
        self.ax.set_aspect("equal", anchor="NW")
        self.ax.set_xlim(0, 1e3 * length_m)
        self.ax.set_ylim(0, 1e3 * width_m)
        self.labels("x, mm", "y, mm")

    def line(self, x: Any, y: Any, index: int, label: str | None = None, **options: Any) -> None:
        options = {"color": self.colour(index), "linestyle": self.dashes(index), **options}
        self.ax.plot(x, y, label=label, **options)

    def reference(self, x: Any, y: Any, label: str | None = None) -> None:
        """A dashed line in ink: what others are compared with."""
        self.ax.plot(x, y, color=self.ink, linestyle="--", linewidth=1.0, label=label, zorder=2.5)

    def band(self, x: Any, low: Any, high: Any, index: int, label: str | None = None) -> None:
        self.ax.fill_between(x, low, high, color=self.colour(index), alpha=0.25, linewidth=0, label=label)

    def markers(self, x: Any, y: Any, index: int, label: str | None = None, marker: str = "o", **options: Any) -> None:
        options = {"color": self.colour(index), "markersize": self.marker_size, **options}
        self.ax.plot(x, y, linestyle="none", marker=marker, label=label, **options)

    def level(self, y: float, label: str | None = None) -> None:
        """A thin line across, such as a tolerance."""
        self.ax.axhline(y, color=self.quiet, linewidth=0.8, linestyle=":", label=label, zorder=1)

    def zone(self, low: float, high: float, label: str | None = None, hatch: str | None = None) -> None:
        """A stretch of the surface that is set apart: shaded, or hatched."""
        face = colors.to_rgba(self.ink, 0.15) if hatch is None else "none"
        edge = colors.to_rgba(self.ink, 0.4)
        self.ax.axvspan(low, high, facecolor=face, edgecolor=edge, hatch=hatch, linewidth=0, label=label, zorder=0.5)

    def rows(self, names: Sequence[str]) -> None:
        """A vertical axis of named rows, the first uppermost."""
        self.ax.set_yticks(range(len(names)), labels=list(names))
        self.ax.set_ylim(len(names) - 0.4, -0.6)
        self.ax.tick_params(axis="y", length=0)

    def legend(self) -> None:
        """A legend above the axes, in as many columns as fit, where there is more than one entry."""
        handles, labels = self.ax.get_legend_handles_labels()
        if len(labels) < 2:
            return
        most = min(len(labels), _MOST_COLUMNS)
        legend = self._legend(handles, labels, most)
        if legend.get_window_extent().width > 0.6 * self._room():
            self._lay_out(legend)
            room = self._room()
            while most > 1 and legend.get_window_extent().width > room:
                most -= 1
                legend = self._legend(handles, labels, most)
            legend.set_in_layout(True)
        if self.ax.get_aspect() != "auto" and self._figure.get_layout_engine() is not None:
            # Axes that are drawn to scale need two layout passes: this is the first, the next drawing is the second.
            self._figure.draw_without_rendering()

    def _legend(self, handles: Any, labels: Any, columns: int) -> Legend:
        return self.ax.legend(
            handles,
            labels,
            loc="lower left",
            bbox_to_anchor=(0.0, 1.01),
            borderaxespad=0.0,
            borderpad=0.2,
            ncols=columns,
            frameon=False,
            labelcolor=self.ink,
            fontsize="small",
            handlelength=1.4,
            handletextpad=0.5,
            columnspacing=1.0,
        )

    def _lay_out(self, legend: Legend) -> None:
        """Puts the axes where they will be, so that it is known what fits beside them."""
        if self._figure.get_layout_engine() is not None:
            legend.set_in_layout(False)
            self._figure.draw_without_rendering()

    @property
    def _figure(self) -> Any:
        """The figure of the axes, beneath all subfigures."""
        return self.ax.figure.figure

    def _room(self) -> float:
        """Width from the left of the axes to the right of the figure, in pixels."""
        return float(self.ax.figure.bbox.x1 - self.ax.get_window_extent().x0)

    def heat_map(self, x_m: Floats, y_m: Floats, values: Floats, length_m: float, width_m: float, label: str, most: float | None = None) -> None:
        """Values over a plane as colours: cells where the places lie on a grid, else dots; with a colour bar."""
        self.to_scale(length_m, width_m)
        finite = values[np.isfinite(values)]
        top = float(finite.max()) if finite.size else 1.0
        end = top if most is None else min(top, most)
        far_apart = finite.size > 0 and finite.min() > 0 and end >= _FAR_APART * finite.min()
        norm = colors.LogNorm(finite.min(), end) if far_apart else colors.Normalize(min(0.0, finite.min(initial=0.0)), end)
        cmap = mpl.colormaps[mpl.rcParams["image.cmap"]].with_extremes(bad=(0.5, 0.5, 0.5, 0.5))
        grid = _grid(x_m, y_m, values)
        drawn: Any
        if grid is None:
            drawn = self.ax.scatter(1e3 * x_m, 1e3 * y_m, c=values, norm=norm, cmap=cmap, s=4 * self.marker_size**2, plotnonfinite=True)
        else:
            columns, rows, cells = grid
            edges = [1e3 * _edges(columns, length_m), 1e3 * _edges(rows, width_m)]
            drawn = self.ax.pcolormesh(*edges, np.ma.masked_invalid(cells), norm=norm, cmap=cmap, rasterized=True)
        self._bar(drawn, label, "max" if top > end else "neither", far_apart)

    def _bar(self, drawn: Any, label: str, extend: str, logarithmic: bool) -> None:
        place = self.ax.inset_axes((1.03, 0.0, 0.04, 1.0))
        bar = self.ax.figure.colorbar(drawn, cax=place, extend=extend)
        if logarithmic:
            bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            bar.ax.yaxis.set_major_locator(_plain_ticks(drawn.norm.vmin, drawn.norm.vmax))
            bar.ax.yaxis.set_minor_formatter(NullFormatter())
        bar.set_label(label, color=self.ink)
        bar.ax.tick_params(which="both", colors=self.ink)
        bar.outline.set_edgecolor(self.quiet)


def _plain_ticks(low: float, high: float) -> LogLocator:
    """Ticks of a logarithmic axis at round numbers, as many as its decades leave room for."""
    decades = np.log10(high / low) if low > 0 else np.inf
    if decades > 2:
        return LogLocator(subs=(1.0,))
    return LogLocator(subs=(1.0, 2.0, 5.0) if decades > 0.9 else (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0))


def _new_axes(size: tuple[float, float]) -> Axes:
    """Axes of a new figure; a style sheet may set its size."""
    import matplotlib.pyplot as plt

    own = tuple(mpl.rcParams["figure.figsize"])
    if own != tuple(mpl.rcParamsDefault["figure.figsize"]):
        size = (own[0], own[0] * size[1] / size[0])
    return plt.subplots(figsize=size, layout="constrained")[1]


def _grid(x: Floats, y: Floats, values: Floats) -> tuple[Floats, Floats, Floats] | None:
    """Columns, rows and cells of values at places on a grid, NaN in empty cells; None if most cells would be empty."""
    columns, column = np.unique(np.round(x, 9), return_inverse=True)
    rows, row = np.unique(np.round(y, 9), return_inverse=True)
    if columns.size < 2 or rows.size < 2 or columns.size * rows.size >= 4 * x.size:
        return None
    cells = np.full((rows.size, columns.size), np.nan)
    cells[row.ravel(), column.ravel()] = values
    return columns, rows, cells


def _edges(middles: Floats, size: float) -> Floats:
    """Edges of the cells around these places; those next to the surface's ends reach up to them."""
    between = 0.5 * (middles[1:] + middles[:-1])
    gaps = np.diff(middles)
    first = 0.0 if middles[0] <= 1.01 * gaps[0] else middles[0] - 0.5 * gaps[0]
    last = size if size - middles[-1] <= 1.01 * gaps[-1] else middles[-1] + 0.5 * gaps[-1]
    return np.concatenate([[first], between, [last]])
