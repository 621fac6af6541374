"""Errors, in palpate's own words."""

from __future__ import annotations


class PalpateError(ValueError):
    """An input that palpate refuses: the value, its bound, its place and what to do."""


class FileError(PalpateError):
    """A file or a text that palpate refuses, with the place.

    Attributes
    ----------
    source : str
        Name of the file, or of the text.
    line, column : int or None
        Place, from 1, where there is one.
    """

    def __init__(self, message: str, source: str = "", line: int | None = None, column: int | None = None) -> None:
        super().__init__(message, source, line, column)
        self.source = source
        self.line = line
        self.column = column

    def __str__(self) -> str:
        return str(self.args[0])
