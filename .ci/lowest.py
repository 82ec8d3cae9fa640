"""The lowest versions that pyproject.toml allows, one a line: python .ci/lowest.py [EXTRA...]."""

import re
import sys
import tomllib
from pathlib import Path

project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]
extras = (project["optional-dependencies"][name] for name in sys.argv[1:])
for requirement in (*project["dependencies"], *(one for extra in extras for one in extra)):
    print(re.sub(r">=([\d.]+)$", r"==\1.*", requirement))
