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
from ._design import next_press, placement_curve, placement_limit, training_errors
from ._errors import calibration, comparison, error_histogram, errors, errors_along, predicted, shares
from ._estimates import contacts
from ._limit import force_limit, lightest_touch, limit
from ._loads import kernel_widths, kernels, load_profile, residuals
from ._readings import influence, recording
from ._studies import study
from ._tracks import speeds, track, track_errors
from ._training import convergence

__all__ = [
    "arrangements",
    "calibration",
    "comparison",
    "contacts",
    "convergence",
    "error_histogram",
    "errors",
    "errors_along",
    "force_limit",
    "influence",
    "kernel_widths",
    "kernels",
    "layouts",
    "lightest_touch",
    "limit",
    "load_profile",
    "next_press",
    "placement_curve",
    "placement_limit",
    "predicted",
    "recording",
    "residuals",
    "setup",
    "shares",
    "speeds",
    "study",
    "track",
    "track_errors",
    "training_errors",
]
