"""Objects as a notebook shows them."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ._palpate import Estimates, Locator, Recording, Setup

_WIDTH = 560.0
_MARGIN = 24.0
_ROWS = 10
# Units of readings in tables, and their number per SI unit.
_UNITS = {"deflection": ("mm", 1e3), "slope": ("mrad", 1e3), "strain": ("um/m", 1e6), "reaction": ("N", 1.0), "raw": ("", 1.0)}
# Colours of sensor types, as in the figures.
_COLOURS = {"deflection": "#009e73", "slope": "#d55e00", "strain": "#0072b2", "reaction": "#cc79a7"}


def setup(setup: Setup) -> str:
    """A setup in words, and drawn to scale: the surface with its supports and sensors."""
    return f"<div>{html.escape(repr(setup)[1:-1])}</div>{_drawing(setup)}"


def recording(recording: Recording) -> str:
    """A recording in words, its warnings, and its first rows."""
    warnings = "".join(f"<li>{html.escape(warning)}</li>" for warning in recording.warnings)
    listed = f"<ul>{warnings}</ul>" if warnings else ""
    return f"<div>{html.escape(repr(recording)[1:-1])}</div>{listed}{_table(_recording_rows(recording), len(recording))}"


def locator(locator: Locator) -> str:
    """A locator in words, with its setup drawn."""
    return f"<div>{html.escape(repr(locator)[1:-1])}</div>{setup(locator.setup)}"


def estimates(estimates: Estimates) -> str:
    """Estimates in words, and the first of them."""
    rows: dict[str, list[str]] = {"x [mm]": [f"{x * 1e3:.3f}" for x in estimates.x[:_ROWS]]}
    if estimates.y is not None:
        rows["y [mm]"] = [f"{y * 1e3:.3f}" for y in estimates.y[:_ROWS]]
    rows["force [N]"] = ["" if np.isnan(force) else f"{force:.3f}" for force in estimates.force[:_ROWS]]
    rows["95 % of x [mm]"] = [
        "" if np.isnan(low) else f"{low * 1e3:.3f} – {high * 1e3:.3f}" for low, high in estimates.x_95[:_ROWS]
    ]
    rows["status"] = [str(status) for status in estimates.status[:_ROWS]]
    return f"<div>{html.escape(repr(estimates)[1:-1])}</div>{_table(rows, len(estimates))}"


def rows(title: str, columns: Mapping[str, Any], notes: Sequence[str] = ()) -> str:
    """A title, what is to be noted, and the first rows of columns."""
    count = len(next(iter(columns.values())))
    listed = "".join(f"<li>{html.escape(note)}</li>" for note in notes)
    cells = {name: [_cell(value) for value in column[:_ROWS]] for name, column in columns.items()}
    return f"<div>{html.escape(title)}</div>{f'<ul>{listed}</ul>' if listed else ''}{_table(cells, count)}"


def _cell(value: Any) -> str:
    if isinstance(value, (float, np.floating)):
        return "" if np.isnan(value) else f"{value:.4g}"
    return str(value)


def _recording_rows(recording: Recording) -> dict[str, list[str]]:
    rows = {"x [mm]": [f"{x * 1e3:.3f}" for x in recording.x[:_ROWS]]}
    if recording.y is not None:
        rows["y [mm]"] = [f"{y * 1e3:.3f}" for y in recording.y[:_ROWS]]
    rows["force [N]"] = ["" if np.isnan(force) else f"{force:.3f}" for force in recording.force[:_ROWS]]
    for name, measure, values in zip(recording.channels, recording.setup.measures, recording.readings[:_ROWS].T):
        unit, factor = _UNITS[measure]
        rows[f"{name} [{unit}]" if unit else name] = [f"{factor * value:.5g}" for value in values]
    return rows


def _table(columns: dict[str, list[str]], count: int) -> str:
    heading = "".join(f"<th>{html.escape(name)}</th>" for name in columns)
    rows = "".join(
        "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in zip(*columns.values())
    )
    left = f"<div>… {count} rows in all</div>" if count > _ROWS else ""
    return f"<table><thead><tr>{heading}</tr></thead><tbody>{rows}</tbody></table>{left}"


def _drawing(setup: Setup) -> str:
    """The surface to scale in SVG, in the colour of the text around it; a beam from the side, a plane from above."""
    plane = setup.width is not None
    scale = (_WIDTH - 2 * _MARGIN) / setup.length
    if plane and setup.width is not None:
        scale = min(scale, 320.0 / setup.width)
    depth = setup.width * scale if setup.width is not None else 6.0
    height = depth + 2 * _MARGIN + 18
    top = _MARGIN

    def place(position: np.ndarray) -> tuple[float, float]:
        along, across = (position[0], position[1]) if plane else (float(position), 0.0)
        return _MARGIN + scale * along, top + depth - scale * across if plane else top + depth

    parts = [
        f'<rect x="{_MARGIN:.1f}" y="{top:.1f}" width="{setup.length * scale:.1f}" height="{depth:.1f}" '
        'fill="currentColor" fill-opacity="0.15" stroke="currentColor"/>'
    ]
    for kind, support in zip(setup.support_kinds, setup.supports):
        x, y = place(support)
        if kind == "clamped":
            parts.append(f'<path d="M{x:.1f} {top - 9:.1f} v{depth + 18:.1f}" stroke="currentColor" stroke-width="4"/>')
        else:
            parts.append(f'<path d="M{x:.1f} {y:.1f} l-6 11 h12 z" fill="none" stroke="currentColor"/>')
    if setup.kind != "measured":
        for number, position in enumerate(setup.sensor_positions, 1):
            x, y = place(position)
            y -= 0 if plane else depth
            parts.append(
                f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{_COLOURS[setup.measures[number - 1]]}"><title>{html.escape(setup.channels[number - 1])}'
                "</title></circle>"
            )
    size = f"{setup.length * 1e3:g} mm" + (f" × {setup.width * 1e3:g} mm" if setup.width is not None else "")
    parts.append(
        f'<text x="{_MARGIN:.1f}" y="{height - 6:.1f}" font-size="12" fill="currentColor">{size}, '
        f"{len(setup.channels)} sensors</text>"
    )
    return f'<svg width="{_WIDTH:.0f}" height="{height:.0f}" role="img" aria-label="{size}">{"".join(parts)}</svg>'
