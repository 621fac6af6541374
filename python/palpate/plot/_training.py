"""Pictures of training: how soon networks converge."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from .._errors import PalpateError
from .._palpate import Locator
from ._canvas import Canvas
from ._checks import check_type


def convergence(locators: Sequence[Locator] | Mapping[str, Sequence[Locator]], *, ax: Axes | None = None) -> Axes:
    """Share of the networks whose training has converged, by epochs.

    Parameters
    ----------
    locators : sequence of Locator, or mapping of str to such
        Networks of several seeds, as `fit_many` trains them; or several such by their names.
    ax : matplotlib.axes.Axes, optional
        Where to draw; new axes where nothing is said.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import palpate as pp, palpate.plot
    >>> setup = pp.Setup(pp.Beam("400 mm", "40 mm", "1.2 mm", "200 GPa"), pp.deflection(8), force="3 N")
    >>> networks = pp.Network(aggregate_error=0.01).of(setup).fit_many(setup.simulate(pp.even(10)), range(8))
    >>> ax = pp.plot.convergence(networks)
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('epochs', 'converged, %')
    """
    groups: dict[str, Any] = dict(locators) if isinstance(locators, Mapping) else {"": locators}
    listed = {name: [_outcome(one) for one in ([group] if isinstance(group, Locator) else group)] for name, group in groups.items()}
    if not listed or not all(listed.values()):
        raise PalpateError("0 networks; at least one is needed")
    most = max(float(outcome["epochs"]) for outcomes in listed.values() for outcome in outcomes)
    canvas = Canvas(ax)
    for index, (name, outcomes) in enumerate(listed.items()):
        epochs = np.sort([outcome["epochs"] for outcome in outcomes if outcome["status"] == "converged"])
        share = 100 * np.arange(1, epochs.size + 1) / len(outcomes)
        reached = share[-1] if epochs.size else 0.0
        x, y = np.r_[epochs[:1], epochs, most], np.r_[np.zeros(epochs[:1].size), share, reached]
        canvas.ax.step(x, y, where="post", color=canvas.colour(index), linestyle=canvas.dashes(index), label=name or None)
    canvas.logarithmic(canvas.ax.xaxis)
    canvas.ax.set_ylim(0, 102)
    canvas.labels("epochs", "converged, %")
    canvas.legend()
    return canvas.ax


def _outcome(locator: Any) -> dict[str, Any]:
    check_type(locator, Locator)
    if locator.training is None:
        raise PalpateError(f"a locator of the kind {locator.kind} is not trained by epochs; `Network` is")
    outcome: dict[str, Any] = locator.training
    return outcome
