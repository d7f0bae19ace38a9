"""The lowest versions that pyproject.toml declares, as pip wants them: of what the package needs, and of what its tests do.

    python .ci/lowest.py            # numpy==2.0 scipy==1.13 ... pytest==8 ...
    python .ci/lowest.py --python   # python3.11

Tools that only look at the source (lint, types, imports) are left out: they run once, with the versions of the day.
"""

import re
import sys
import tomllib
from pathlib import Path

_TESTS_NEED = ("pytest", "pytest-xdist", "hypothesis", "mpmath", "jsonschema")

project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]
if "--python" in sys.argv:
    print("python" + project["requires-python"].removeprefix(">="))
else:
    tools = [need for need in project["optional-dependencies"]["dev"] if re.match(r"[\w-]+", need)[0] in _TESTS_NEED]
    print(*(need.replace(">=", "==") for need in project["dependencies"] + tools))
