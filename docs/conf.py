# Copyright 2026 satform contributors
# SPDX-License-Identifier: Apache-2.0
"""Settings of Sphinx for the documentation site that `./tools/satform docs` builds."""

from pathlib import Path

from satform_tools.docs.sphinx_hooks import connect

project = "satform"
author = "satform contributors"
copyright = "2026 satform contributors"  # noqa: A001 - Sphinx's name for it
release = version = (
    (Path(__file__).parents[1] / "ros_ws/src/satform/package.xml")
    .read_text(encoding="utf-8")
    .partition("<version>")[2]
    .partition("</version>")[0]
)

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax"]
# The source folder is the whole project, so that links between pages, package READMEs and scenario files are
# the same here and in a checkout.
include_patterns = ["README.md", "*.md", "docs/**", "docker/*.md", "ros_ws/src/*/README.md", "tests/**/*.md"]
exclude_patterns = [
    ".*",
    "**/.*",
    "runs",
    "keystores",
    "site",
    "ros_ws/build",
    "ros_ws/install",
    "ros_ws/log",
]
root_doc = "docs/index"
default_role = "code"
nitpicky = False

# Markdown as GitHub shows it: $ and $$ are equations, headings are targets of links.
myst_enable_extensions = ["dollarmath", "amsmath"]
myst_heading_anchors = 6
myst_fence_as_directive = ["math"]
myst_dmath_double_inline = True
myst_links_external_new_tab = False

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
maximum_signature_line_length = 100
# With every function in the table of contents of every page, the build takes ten times as long.
toc_object_entries = False
napoleon_numpy_docstring = False
napoleon_use_rtype = False
napoleon_attr_annotations = False

html_theme = "furo"
html_title = f"satform {version}"
html_static_path = ["_static"]
html_css_files = ["satform.css"]
html_copy_source = False
html_show_sphinx = False
# Served from this folder, so that a page needs no network.
mathjax_path = "mathjax/tex-svg.js"
mathjax3_config = {"options": {"enableMenu": False}, "tex": {"tags": "none"}}

setup = connect
