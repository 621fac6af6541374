"""Pictures of studies: errors along the surface, over the seeds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from .._errors import PalpateError
from .._study import StudyResults
from ._canvas import Canvas
from ._checks import check_type

# Largest number of overlapping bands that stay distinguishable.
_MOST_BANDS = 2


def study(results: StudyResults, arms: str | Sequence[str] | None = None, *, ax: Axes | None = None) -> Axes:
    """Errors along the surface of some arms of a study: the median over the seeds, and with few arms the band from 5 to 95 %.

    Parameters
    ----------
    results : StudyResults
        What `Study.run` found.
    arms : str or sequence of str, optional
        Names of arms; all where nothing is said.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> study = pp.Study.from_toml(pp.Study("paper").text.replace("max_epochs = 1_000_000", "max_epochs = 100"))
    >>> ax = pp.plot.study(study.run(seeds=2, progress=False), ["position-10", "middle4-10"])
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('contact position, mm', 'error, mm')
    """
    check_type(results, StudyResults)
    wanted = results.names if arms is None else [arms] if isinstance(arms, str) else list(arms)
    if not wanted:
        raise PalpateError("`arms` names 0 arms; it must name at least 1")
    canvas = Canvas(ax)
    medians = []
    for index, name in enumerate(wanted):
        if name not in results.names:
            raise PalpateError(f"`arms` names {name!r}; the study has {', '.join(results.names)}")
        along = results.by_position[results.names.index(name)]
        x, error = 1e3 * along["x"], 1e3 * along["error"]
        if len(wanted) <= _MOST_BANDS:
            canvas.band(x, error[:, 1], error[:, 2], index)
        canvas.line(x, error[:, 0], index, name)
        medians.append(error[:, 0])
    canvas.ax.margins(x=0)
    canvas.scale_by(np.concatenate(medians))
    canvas.labels("contact position, mm", "error, mm")
    canvas.legend()
    return canvas.ax
