"""The documentation: `sphinx-build -W --keep-going -b html docs docs/_build`. Needs no network;
notebooks are executed as it builds.
"""

import os
import sys
import tempfile
from pathlib import Path

import saltus

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "_ext"))

project = "saltus"
author = "The saltus developers"
copyright = author
version = release = saltus.__version__

extensions = [
    "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax", "myst_nb",
    "glossary_terms", "decision_notes", "study_tables", "result_tables", "measured", "claims",
    "floors", "offline",
]  # fmt: skip
# pictures/ holds those of the README, comparison/ and replication/ data that pages read.
exclude_patterns = ["_build", "_ext", "pictures", "comparison", "replication"]
templates_path = []

# -- look ------------------------------------------------------------------------------------------
html_theme = "furo"
html_title = "saltus"
html_static_path = ["_static"]
html_css_files = ["saltus.css"]
html_copy_source = False
html_show_sphinx = False
# No server but the reader's own: MathJax lies beside the pages, and `offline` fails the build if
# one loads anything from elsewhere.
mathjax_path = "mathjax/tex-svg.js"
pygments_style, pygments_dark_style = "friendly", "monokai"

# -- text and notebooks ----------------------------------------------------------------------------
myst_enable_extensions = ["amsmath", "deflist", "dollarmath"]
myst_heading_anchors = 3
# Where MathJax looks: the formulas of a System are HTML that a cell put out. Its class "text_html"
# isn't among MyST's own.
myst_mathjax_classes = "tex2jax_process|mathjax_process|math|output_area|text_html"
# Always executed: a page can't show what the code of today doesn't print. In a folder of its own,
# so that nothing is left behind.
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_raise_on_error = True
#: Seconds for one cell: a cold system of four states compiles for 40 s on a busy core.
nb_execution_timeout = 600
nb_execution_show_tb = True
nb_merge_streams = True
nb_output_stderr = "remove"  # what is being compiled, and how far it is, belongs on a terminal
# A caller's backend for files would leave the notebooks without pictures; the notebooks' own has a
# sharp 150 dots an inch from the style.
os.environ.pop("MPLBACKEND", None)
os.environ["MATPLOTLIBRC"] = str(HERE / "matplotlibrc")
# A notebook is over before a flow gains by being compiled once more in the background, and so are
# its commands `saltus ...`, which are those of this interpreter. Nobody presses Ctrl-C there, for
# which another process would compile what takes long, after it has imported everything once more.
notebooks_home = tempfile.TemporaryDirectory()
first_tier = """\
from saltus.codegen import building, kernels
kernels.STEADY_AFTER = building.OTHER_PROCESS = float("inf")
del building, kernels
"""
first_lines = Path(notebooks_home.name, "profile_default", "startup", "first_tier.py")
first_lines.parent.mkdir(parents=True)
first_lines.write_text(first_tier)
os.environ["IPYTHONDIR"] = notebooks_home.name
command = Path(notebooks_home.name, "bin", "saltus")
command.parent.mkdir()
command.write_text(f"#!{sys.executable}\n{first_tier}from saltus.cli import main\n\nmain()\n")
command.chmod(0o755)
os.environ["PATH"] = os.pathsep.join([str(command.parent), os.environ.get("PATH", "")])
# Their tables are as wide as those of a terminal.
os.environ["COLUMNS"] = "170"

# -- API -------------------------------------------------------------------------------------------
autodoc_typehints = "none"  # the docstrings say types, with units and shapes
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
napoleon_custom_sections = [("Raises", "Raises")]
