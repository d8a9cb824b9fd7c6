"""The API reference, built from the docstrings by ``make docs``."""

from importlib.metadata import version as _version

project = "adapt-mimic"
release = version = _version("adapt-mimic")
extensions = ["sphinx.ext.apidoc", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode"]
_PACKAGES = ("agents", "configs", "datasets", "envs", "eval", "trainers")
apidoc_separate_modules = True
apidoc_module_first = True
apidoc_exclude_patterns = ["**/__main__.py"]
apidoc_modules = [{"path": f"../../{package}", "destination": package} for package in _PACKAGES]
autodoc_typehints = "description"
autodoc_member_order = "bysource"
napoleon_numpy_docstring = False
napoleon_use_ivar = True  # attributes are documented in the class alone, not a second time
suppress_warnings = ["ref.python"]  # fields of one name in several classes
html_theme = "alabaster"
html_theme_options = {"page_width": "1100px", "fixed_sidebar": True}


def _show_tables_as_text(app, what, name, obj, options, lines):  # noqa: ANN001, ANN202 (Sphinx's signature)
    """Make Markdown tables in docstrings, such as that of ``AdaptMimic-v0``, literal blocks."""
    inside = False
    for index, line in reversed(list(enumerate(lines))):
        starts = line.startswith("|")
        if starts:
            lines[index] = "    " + line
        elif inside:
            lines.insert(index + 1, "")
            lines.insert(index + 1, "::")
            lines.insert(index + 1, "")
        inside = starts


def setup(app):  # noqa: ANN001, ANN201 (Sphinx's signature)
    """Connect the conversion."""
    app.connect("autodoc-process-docstring", _show_tables_as_text)
