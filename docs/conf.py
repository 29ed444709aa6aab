"""Sphinx configuration: everything is built from this repository, without network access.

Code in pages is executed by MyST-NB and an error stops the build. Formulas are drawn when the pages are built
(`_ext/svgmath.py`), so a reader needs no script and no network. There are no links into other projects' inventories,
since these would be downloaded.
"""

import sys
from pathlib import Path

import halfdof_ctrl

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

project = "halfdof_ctrl"
author = "the halfdof_ctrl developers"
copyright = "2026, the halfdof_ctrl developers"
version = release = halfdof_ctrl.__version__

extensions = ["sphinx.ext.autodoc", "sphinx.ext.autosummary", "numpydoc", "myst_nb", "svgmath"]
exclude_patterns = ["_build", "_ext", "jupyter_execute"]
html_theme = "furo"
html_title = f"halfdof_ctrl {release}"
html_static_path = ["_static"]
html_css_files = ["halfdof.css"]
html_copy_source = False
html_show_sourcelink = False
html_math_renderer = "svg"
html_search_scorer = str(Path(__file__).parent / "_ext" / "scorer.js")  # public names first

default_role = "py:obj"
autodoc_typehints = "none"
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
autosummary_generate = False
numpydoc_show_class_members = False
numpydoc_validation_checks: set[str] = set()

myst_enable_extensions = ["dollarmath", "deflist", "colon_fence"]
myst_heading_anchors = 3
myst_update_mathjax = False
myst_dmath_double_inline = True

nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 120
nb_execution_in_temp = True
nb_execution_show_tb = True
nb_merge_streams = True
nb_render_markdown_format = "myst"
