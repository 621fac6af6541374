"""Links from the manuals to files of the project: the site has a copy of each such file, so that it is complete without the repository."""

from __future__ import annotations

import posixpath
import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

PROJECT = Path(__file__).resolve().parent.parent
LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s#]+)(#[^)\s]*)?\)")
# A browser shows these as text.
SUFFIX = ".txt"


def project_path(page: str, target: str) -> str | None:
    """Path from the project's root of a link that leaves docs/; none for another link."""
    if "://" in target or target.startswith(("/", "mailto:")):
        return None
    path = posixpath.normpath(posixpath.join("docs", posixpath.dirname(page), target))
    return None if path == "docs" or path.startswith(("docs/", "../")) else path


def copy_of(path: str) -> str:
    """Place of a project's file in the site."""
    return f"project/{path}{SUFFIX}"


def on_files(files: Files, config: MkDocsConfig) -> Files:
    linked: set[str] = set()
    for file in files.documentation_pages():
        for match in LINK.finditer(file.content_string):
            path = project_path(file.src_uri, match[3])
            if path and (PROJECT / path).is_file():
                linked.add(path)
    for path in sorted(linked):
        files.append(File.generated(config, copy_of(path), content=(PROJECT / path).read_bytes()))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    def link(match: re.Match[str]) -> str:
        path = project_path(page.file.src_uri, match[3])
        if path is None:
            return match[0]
        if (PROJECT / path).is_file():
            return f"[{match[2]}]({posixpath.relpath(copy_of(path), posixpath.dirname(page.file.src_uri) or '.')})"
        # A folder has no copy: its name stays. Anything else stays a link, which the build then refuses.
        return f"`{path}`" if (PROJECT / path).is_dir() else match[0]

    return LINK.sub(link, markdown)
