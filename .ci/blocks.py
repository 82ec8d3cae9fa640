"""Run the python and sh blocks of a Markdown file in the current folder."""

import re
import subprocess
import sys
from pathlib import Path

for kind, block in re.findall(r"```(python|sh)\n(.*?)```", Path(sys.argv[1]).read_text(), re.S):
    command = [sys.executable, "-c", block] if kind == "python" else ["sh", "-ec", block]
    subprocess.run(command, check=True)
