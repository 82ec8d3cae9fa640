"""A law of your own in a study, by its file

The file stands beside the study, its parameters in the study; it runs only where that is allowed
(--allow-code), after its conformance run. Here its loop is drawn before a curve is asked for.
"""

import shutil
from pathlib import Path

import numpy as np

from tipdamp import Problem, code_allowed, contact_cycles, load_study
from tipdamp.cli import main

NAME = '{ name = "creeping_contact.py:CreepingContact", elastic = 0.1 }'
main(["init", "mine"])
laws = Path(__file__).parents[1] / "studies" / "own_law"
shutil.copy(laws / "creeping_contact.py", "mine")
file = Path("mine/study.toml")
file.write_text(file.read_text().replace("[respond]", f"[respond]\nlaw = {NAME}"))

with code_allowed():
    law = load_study(file).respond.law.make()
pair = Problem(np.eye(2), 0.05 * np.eye(2), np.eye(2)).add(law, (0, 1), kt=2.0, mu=0.5, preload=1.0)
curve = pair.force(0, 1.0).follow_band((0.2, 0.3), outputs={"x": 0}, harmonics=1)
loop = contact_cycles(curve, pair.force(0, 1.0).contact_problem, 0)
loop.plot().set_title("Creeping friction beside a spring that never slips")

assert law.elastic == 0.1 and curve.complete
