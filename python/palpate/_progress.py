"""Progress of long work: in a terminal, in a notebook, or to a function."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from typing import Any, Protocol, Union

Progress = Union[bool, Callable[[str, float, Union[float, None]], Any], None]
"""A bar where somebody sees it (None), nowhere (False), anywhere (True), or a function of (stage, done, total)."""


class Shown(Protocol):
    """What shows progress."""

    def update(self, stage: str, done: float, total: float | None) -> None: ...

    def close(self) -> None: ...


def show(wanted: Progress) -> Shown | None:
    """The requested display of progress; `None` without a terminal or notebook."""
    if wanted is None:
        wanted = _in_notebook() or sys.stderr is not None and sys.stderr.isatty()
    if callable(wanted):
        return _Call(wanted)
    return _bar() if wanted else None


def _in_notebook() -> bool:
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return shell is not None and type(shell).__name__ == "ZMQInteractiveShell"


def _bar() -> Shown:
    try:
        import tqdm
    except ImportError:
        return _Line()
    if _in_notebook():
        # Without ipywidgets, a notebook shows the terminal bar.
        if importlib.util.find_spec("ipywidgets") is not None:
            from tqdm.notebook import tqdm as notebook_bar

            return _Tqdm(notebook_bar)
    return _Tqdm(tqdm.tqdm)


class _Call:
    def __init__(self, function: Callable[[str, float, float | None], Any]) -> None:
        self.function = function

    def update(self, stage: str, done: float, total: float | None) -> None:
        self.function(stage, done, total)

    def close(self) -> None:
        pass


class _Tqdm:
    """A bar of tqdm for each stage."""

    def __init__(self, make: Any) -> None:
        self.make = make
        self.bar: Any = None
        self.stage = ""

    def update(self, stage: str, done: float, total: float | None) -> None:
        if self.bar is None or stage != self.stage:
            self.close()
            self.bar, self.stage = self.make(desc=stage, total=total, leave=False), stage
        self.bar.update(done - self.bar.n)

    def close(self) -> None:
        if self.bar is not None:
            self.bar.close()
            self.bar = None


class _Line:
    """One line of text, rewritten."""

    def __init__(self) -> None:
        self.width = 0

    def update(self, stage: str, done: float, total: float | None) -> None:
        text = f"{stage}: {done:g}" if total is None else f"{stage}: {100 * done / total:.0f} %"
        sys.stderr.write("\r" + text.ljust(self.width))
        sys.stderr.flush()
        self.width = len(text)

    def close(self) -> None:
        if self.width:
            sys.stderr.write("\r" + " " * self.width + "\r")
            sys.stderr.flush()
            self.width = 0
