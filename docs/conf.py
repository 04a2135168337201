"""Configuration of the documentation; ``make docs`` builds it offline, with warnings as errors."""

import sys
from importlib.resources import files
from pathlib import Path

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS / "extensions"))

import api_pages  # noqa: E402  (local extensions, found by the path above)
import column_pages  # noqa: E402
import command_pages  # noqa: E402
import configuration_pages  # noqa: E402

import per_obspy  # noqa: E402

project = "per_obspy"
author = "The per_obspy developers"
version = release = per_obspy.__version__

extensions = [
    "mathml",
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_gallery.gen_gallery",
]
root_doc = "index"
exclude_patterns = ["extensions", "gallery", "recipe", "generated/gallery/*.py"]

myst_enable_extensions = ["amsmath", "deflist", "dollarmath", "substitution"]
myst_substitutions = {"version": version}
myst_heading_anchors = 3
suppress_warnings = ["config.cache"]  # functions of the gallery's configuration are not pickled

numpydoc_show_class_members = False
autosummary_generate = True
autodoc_typehints = "none"  # numpydoc lists the types with shapes and units
autodoc_preserve_defaults = True
math_renderer = "mathml"

html_theme = "sphinx_book_theme"
html_title = f"per_obspy {version}"
# A font with stretching brackets and roots, which comes with ziamath (SIL Open Font Licence)
html_static_path = ["static", str(files("ziamath") / "fonts")]
html_css_files = ["site.css"]
html_sourcelink_suffix = ""
html_copy_source = False
html_theme_options = {
    "show_toc_level": 2,
    "use_download_button": False,
    "use_fullscreen_button": False,
    "use_source_button": False,
}

sphinx_gallery_conf = {
    "examples_dirs": "gallery",
    "gallery_dirs": "generated/gallery",
    "within_subsection_order": "FileNameSortKey",
    "abort_on_example_error": True,
    "download_all_examples": False,
    "write_computation_times": False,  # its page would fetch scripts from elsewhere
    "show_memory": False,
    "show_signature": False,
    "min_reported_time": 10,
}


def setup(app: object) -> None:  # noqa: ARG001  (called by Sphinx)
    """Write the pages that are made from the code, before Sphinx looks for sources."""
    generated = DOCS / "generated"
    generated.mkdir(exist_ok=True)
    for pages in (api_pages, column_pages, command_pages, configuration_pages):
        pages.write(generated)
