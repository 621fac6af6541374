"""Pictures with Matplotlib: a function for each figure that palpate's reports have.

Every function takes `ax`, the axes to draw on, and returns the axes; without it a new figure is made. Positions are in mm and forces in N. Legends
stand above the axes, so a title is best one of the figure: ``ax.figure.suptitle("…")``. Colours are told apart by people with colour blindness, and
follow the style sheet: on a dark ground they are lighter.

>>> import palpate as pp, palpate.plot
>>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8, noise="5 um"), force="3 N")
>>> ax = pp.plot.setup(setup)
>>> ax.figure.savefig("bench.pdf")  # doctest: +SKIP
"""

from __future__ import annotations

try:
    import matplotlib as _  # noqa: F401
except ImportError as error:
    raise ImportError("palpate.plot needs Matplotlib: pip install matplotlib") from error

from ._bench import arrangements, layouts, setup
from ._estimates import contacts
from ._limit import force_limit, lightest_touch, limit
from ._readings import influence, recording

__all__ = [
    "arrangements",
    "contacts",
    "force_limit",
    "influence",
    "layouts",
    "lightest_touch",
    "limit",
    "recording",
    "setup",
]
