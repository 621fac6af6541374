"""Docstrings of the Python package's extension, from its Rust source: the stubs have types alone, and the extension is not built for the site."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import griffe

SOURCES = Path(__file__).resolve().parent.parent / "python/src"
COMMENT = re.compile(r"^\s*/// ?(.*)$")
ATTRIBUTE = re.compile(r"^\s*#\[")
STRUCT = re.compile(r"^pub struct (\w+)")
IMPL = re.compile(r"^impl (\w+) \{")
FUNCTION = re.compile(r"^\s*(?:pub )?fn (\w+)")


def docstrings(source: str) -> dict[str, str]:
    """Doc comments of classes, of the methods in `#[pymethods]`, and of functions, by name: ``Locator``, ``Locator.locate``, ``parse_quantity``."""
    found: dict[str, str] = {}
    comment: list[str] = []
    attributes = ""
    methods_of: str | None = None
    for line in source.splitlines():
        if match := COMMENT.match(line):
            comment.append(match[1])
            continue
        if ATTRIBUTE.match(line):
            attributes += line
            continue
        if line == "}":
            methods_of = None
        elif (match := IMPL.match(line)) and "pymethods" in attributes:
            methods_of = match[1]
        elif (match := STRUCT.match(line)) and "pyclass" in attributes:
            found[match[1]] = "\n".join(comment)
        elif match := FUNCTION.match(line):
            # A constructor's comment is that of its class.
            name = methods_of if "#[new]" in attributes else f"{methods_of}.{match[1]}"
            if methods_of and comment:
                found[name or ""] = "\n".join(filter(None, [found.get(name or ""), "\n".join(comment)]))
            elif "pyfunction" in attributes:
                found[match[1]] = "\n".join(comment)
        comment, attributes = [], ""
    return {name: text for name, text in found.items() if text}


def default(value: Any) -> Any:
    """Default of a field that `needed()` or `key()` declares: none, and the one that it names or `None`."""
    text = str(value)
    if text.startswith("needed("):
        return None
    if text.startswith("key("):
        match = re.search(r"default=(.*?)[,)]", text)
        return match[1] if match else "None"
    return value


def show_defaults(section: griffe.Class) -> None:
    """Replaces the declarations of fields by their defaults."""
    for member in section.members.values():
        if isinstance(member, griffe.Attribute):
            member.value = default(member.value)
        elif isinstance(member, griffe.Function) and member.name == "__init__":
            for parameter in member.parameters:
                parameter.default = default(parameter.default)


class RustDocstrings(griffe.Extension):
    """Adds the docstrings to the objects of the stubs."""

    def on_package(self, *, pkg: griffe.Module, **_: Any) -> None:
        for module in filter(lambda member: isinstance(member, griffe.Module), pkg.members.values()):
            for member in module.members.values():
                if isinstance(member, griffe.Class):
                    show_defaults(member)
        extension = pkg.members.get("_palpate")
        if not isinstance(extension, griffe.Module):
            return
        for member in extension.members.values():
            # A class of the extension is made by `__new__`; its documentation shows the parameters of `__init__`.
            if isinstance(member, griffe.Class) and "__new__" in member.members:
                constructor = member.members.pop("__new__")
                constructor.name = "__init__"
                member.members["__init__"] = constructor
        for source in sorted(SOURCES.glob("*.rs")):
            for name, text in docstrings(source.read_text(encoding="utf-8")).items():
                owner, _, member = name.partition(".")
                target = extension.members.get(owner)
                if member and isinstance(target, griffe.Class):
                    target = target.members.get(member)
                if isinstance(target, griffe.Object):
                    target.docstring = griffe.Docstring(text, parent=target)
