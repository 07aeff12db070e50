"""What mkdocs does beside its own work: pages out of the code, links into the repository, equations.

Pages in `docs` are written to be read in the repository as well, so their links lead where files lie there.
On the site, `README.md` is its first page, and other files outside `docs` that are linked to come along.
"""

from __future__ import annotations

import html
import posixpath
import re
from pathlib import Path
from typing import TYPE_CHECKING

from latex2mathml.converter import convert
from mkdocs.structure.files import File

from tools.site_pages import generated

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files
    from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[1]
#: Pages of the repository's root.
OUTSIDE = ("CHANGELOG.md", "CONTRIBUTING.md")
_LINK = re.compile(r"(?<=\]\()([^)#:\s]+)(?=[)#])")
_MATH = re.compile(r'<(?:span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</(?:span|div)>', re.DOTALL)


def place_of(source: str) -> str:
    """Return where a page of the site lies in the repository.

    Examples
    --------
    >>> place_of("shading.md"), place_of("CHANGELOG.md")
    ('docs/shading.md', 'CHANGELOG.md')
    """
    return source if source in OUTSIDE else f"docs/{source}"


def file_at(source: str, link: str) -> str:
    """Return which file of the repository a page of the site links to."""
    return posixpath.normpath(posixpath.join(posixpath.dirname(place_of(source)), link))


def source_of(file: str) -> str:
    """Return what a file of the repository is on the site: what is no page, text.

    Examples
    --------
    >>> source_of("README.md"), source_of("docs/security.md"), source_of("benchmarks/load.py")
    ('index.md', 'security.md', 'benchmarks/load.py.txt')
    """
    if file == "README.md":
        return "index.md"
    if file.startswith("docs/"):
        return file.removeprefix("docs/")
    return file if file in OUTSIDE or not (ROOT / file).is_file() else f"{file}.txt"


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add pages that are made of the code, those of the repository's root, and files that they link to."""
    for source, text in generated().items():
        files.append(File.generated(config, source, content=text))
    for source in OUTSIDE:
        files.append(File.generated(config, source, abs_src_path=str(ROOT / source)))
    for page in files.documentation_pages():
        for link in _LINK.findall(page.content_string):
            source = source_of(file_at(page.src_uri, link))
            if source.endswith(".txt") and files.get_file_from_path(source) is None:
                path = str(ROOT / source.removesuffix(".txt"))
                files.append(File.generated(config, source, abs_src_path=path))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:  # noqa: ARG001
    """Have links lead to where the files are on the site."""
    here = posixpath.dirname(page.file.src_uri)

    def on_the_site(found: re.Match[str]) -> str:
        source = source_of(file_at(page.file.src_uri, found[1]))
        return posixpath.relpath(source, here or ".") if files.get_file_from_path(source) else found[1]

    return _LINK.sub(on_the_site, markdown)


def on_page_content(html: str, page: Page, config: MkDocsConfig, files: Files) -> str:  # noqa: ARG001
    """Have equations in MathML, which needs no script; and no heading of a table that says nothing."""
    return _MATH.sub(_mathml, html).replace("<th></th>", "<td></td>")


def _mathml(found: re.Match[str]) -> str:
    block = found[1] == "["
    equation = convert(html.unescape(found[2]), display="block" if block else "inline")
    # Too wide for a phone, an equation scrolls, and has to be reached by the keyboard for that.
    return f'<div class="equation" tabindex="0">{equation}</div>' if block else equation
