"""The site: `make docs`, or `python docs/site/build.py --sphinx PYTHON [--external]`.

Pages of docs/ as they stand, README.md as the first, the gallery, and references read from the
sources are put together in build/site/pages; the Sphinx of the interpreter PYTHON makes HTML of it
in build/site/html. A warning is an error, and so is a link that leads nowhere.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
from pathlib import Path

import c_pages
import fortran_pages
import gallery
import links
import python_pages

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
SITE = ROOT/"build"/"site"

#: Titles of the contents at the left, and their pages.
CONTENTS = {
    "Begin": "tutorial howto gmsh glossary gallery/index",
    "Use": "deck python embedding hosts",
    "Reference": "reference_python reference_c reference_fortran modules",
    "How it works": "theory energy",
    "How well": "verification impacts stability trade performance",
    "The project": "develop changelog",
}
#: Generated pages.
REFERENCES = {"reference_python": python_pages.page, "reference_c": c_pages.page,
              "reference_fortran": fortran_pages.page, "modules": fortran_pages.modules_page}


def adapted(text: str, folder: str) -> str:
    """A page with its links as they are in the site; `folder`: what its own begin with."""
    text = re.sub(r"\]\((?:\.\./)?input_decks/(\w+)\.inp\)", r"](gallery/\1.md)", text)
    text = text.replace("](../", "](").replace(f"]({folder}", "](")
    for name, place in (("README.md", "index.md"), ("CHANGELOG.md", "changelog.md")):
        text = text.replace(f"]({name}", f"]({place}")
    return text


def contents() -> str:
    return "".join(f"\n```{{toctree}}\n:hidden:\n:caption: {title}\n\n"
                   + "\n".join(names.split()) + "\n```\n" for title, names in CONTENTS.items())


def first_page() -> str:
    """README.md, under a title, with the contents of the site."""
    text = (ROOT/"README.md").read_text(encoding="utf-8")
    title = "" if text.startswith("# ") else "# EMCON\n\n"
    return title + adapted(text, "docs/") + contents()


def put_together(pages: Path) -> None:
    """All pages and what they show, in one folder."""
    shutil.rmtree(pages, ignore_errors=True)
    pages.mkdir(parents=True)
    for path in sorted((ROOT/"docs").iterdir()):
        if path.suffix == ".md":
            text = adapted(path.read_text(encoding="utf-8"), "docs/")
            (pages/path.name).write_text(text, encoding="utf-8")
        elif path.suffix in (".png", ".svg", ".gif"):
            shutil.copy(path, pages)
    shutil.copytree(ROOT/"input_decks", pages/"input_decks",
                    ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("LICENSE", "CITATION.cff"):
        shutil.copy(ROOT/name, pages)
    (pages/"index.md").write_text(first_page(), encoding="utf-8")
    (pages/"changelog.md").write_text(
        adapted((ROOT/"CHANGELOG.md").read_text(encoding="utf-8"), "docs/"), encoding="utf-8")
    for name, make in REFERENCES.items():
        (pages/f"{name}.md").write_text(make(), encoding="utf-8")
    gallery.build(pages, SITE/"runs")


def static_files(python: str, pages: Path) -> None:
    """Beside the pages: MathJax of the tools, the one file that makes pictures of formulas, and what
    the theme is changed by."""
    find = "import importlib.util as u; print(u.find_spec('mathjax').submodule_search_locations[0])"
    found = subprocess.run([python, "-c", find], capture_output=True, text=True, check=True)
    static = pages/"_static"
    static.mkdir()
    shutil.copy(Path(found.stdout.strip())/"static/mathjax/es5/tex-svg.js", static)
    shutil.copy(HERE/"site.css", static)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--sphinx", metavar="PYTHON", required=True,
                        help="the interpreter that has Sphinx")
    parser.add_argument("--external", action="store_true",
                        help="ask servers for the pages of others that the site refers to")
    options = parser.parse_args()
    pages, html = SITE/"pages", SITE/"html"
    put_together(pages)
    static_files(options.sphinx, pages)
    shutil.rmtree(html, ignore_errors=True)
    subprocess.run([options.sphinx, "-m", "sphinx", "-q", "-W", "--keep-going", "-j", "auto",
                    "-d", SITE/"doctrees", "-c", HERE, pages, html], check=True)
    found, outside = links.broken(html)
    if options.external:
        found += links.unanswered(outside)
    if found:
        sys.exit("links that lead nowhere:\n" + "\n".join(found))
    print(html/"index.html")


if __name__ == "__main__":
    main()
