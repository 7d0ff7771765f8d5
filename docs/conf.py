"""Settings of the book: Sphinx reads the Markdown of this folder by MyST. docs/build runs it.

Two rules make files that read well both here and on the repository's page. The list of links of an index page (README.md) is
the table of contents: a chapter belongs to the book where an index names it. A link to a file outside of docs/ leads to a copy of that file.
"""

import os
import re
import shutil
from pathlib import Path

from docutils import nodes

ROOT = Path(__file__).resolve().parents[1]
LINK = re.compile(r"\[[^\]]*\]\(([\w./-]+\.md)(?:#[\w-]*)?\)")

project = "Understory"
author = "The Understory authors"
copyright = "The Understory authors, GPL-3.0-or-later"
version = release = re.search(r"^version: (\S+)", (ROOT / "CITATION.cff").read_text(), re.MULTILINE).group(1)

extensions = ["myst_parser"]
source_suffix = {".md": "markdown"}
root_doc = "README"
myst_heading_anchors = 3
nitpicky = True
# A session of the shell with its output is no program text that could be coloured.
highlight_language = "none"

html_theme = "furo"
html_title = f"Understory {version}"
html_show_sphinx = False
html_static_path = ["book.css"]
html_css_files = ["book.css"]
html_copy_source = False
html_theme_options = {"footer_icons": []}
if os.environ.get("UNDERSTORY_BOOK_API"):
    tags.add("api")  # noqa: F821 (Sphinx gives it)


def listed_pages(page, text):
    """The pages that an index names, in its order, as Sphinx calls them."""
    folder = Path(page).parent
    names = []
    for target in LINK.findall(text):
        name = os.path.normpath(folder / target.removesuffix(".md"))
        if not name.startswith("..") and name not in names and name != page:
            names.append(name)
    return names


def add_contents(app, page, source):
    """Index pages get the table of contents that follows from their links."""
    if page == "api" and app.tags.has("api"):
        source[0] += '\n\n<a href="api/index.html">The reference of this build</a>\n'
    if page.startswith("decisions/"):
        # A hundred pages in the navigation of each page take longer than all the rest; their index links them.
        if Path(page).name != "README":
            source[0] = "---\norphan: true\n---\n" + source[0]
        return
    if Path(page).name != "README":
        return
    names = "\n".join("/" + name for name in listed_pages(page, source[0]))
    source[0] += f"\n\n```{{toctree}}\n:hidden:\n\n{names}\n```\n"


def copy_of_file(app, env, node, content):
    """A link to a file of the tree outside of the book leads to a copy of it."""
    target = node.get("reftarget", "").split("#")[0]
    file = (Path(env.doc2path(node["refdoc"])).parent / target).resolve()
    if not target or ROOT not in file.parents or not file.is_file():
        return None
    name = file.relative_to(ROOT)
    copy = Path(app.outdir) / "tree" / name
    copy.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(file, copy)
    up = "../" * node["refdoc"].count("/")
    return nodes.reference("", "", *content.children, refuri=f"{up}tree/{name}")


def setup(app):
    """Sphinx calls this."""
    app.connect("source-read", add_contents)
    app.connect("missing-reference", copy_of_file)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
