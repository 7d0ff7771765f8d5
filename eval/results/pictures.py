"""Which pictures the pages of the tree show: only these are stored. Read by `tables.py` and `refresh`."""

import re
from fnmatch import fnmatch
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
#: A picture by its name, or several by a pattern: `paths.circle.map.png`, `forest-plots.*.png`.
NAMED = re.compile(r"[\w.*-]+\.png")
#: Pages that people write; eval/results/README.md is made from remarks.md.
PAGES = ("*.md", "docs/**/*.md", "common/**/README.md", "services/**/README.md", "deploy/**/README.md", "tests/**/README.md", "eval/*.md", "eval/plot/*.md", "eval/results/*.md")


def named():
    """Names and patterns in all pages."""
    pages = {page for pattern in PAGES for page in ROOT.glob(pattern)} - {HERE / "README.md"}
    return {name for page in pages for name in NAMED.findall(page.read_text())}


def is_shown(picture, names):
    return any(fnmatch(picture, name) for name in names)


def stored_in_vain():
    """Stored pictures that no page names, in order."""
    names = named()
    return sorted(file.name for file in HERE.glob("*.png") if not is_shown(file.name, names))
