"""Settings of Sphinx for the site that docs/site/build.py puts together."""

import tipdamp

project = "tipdamp"
author = "The tipdamp developers"
project_copyright = "The tipdamp developers"
version = release = tipdamp.__version__
extensions = ["myst_parser"]
html_theme = "furo"
html_title = f"tipdamp {release}"
html_copy_source = False
html_use_index = False  # every name has its page
html_show_sphinx = False
html_static_path = ["_static"]
html_css_files = ["site.css"]
myst_heading_anchors = 4
myst_enable_extensions = ["deflist", "attrs_block", "colon_fence"]
suppress_warnings = ["myst.header"]  # README of a folder may begin deeper
