"""A law of your own in a study, by its file

`[respond] law = "dahl.py:Dahl"` beside the study: the file runs only with --allow-code, after its
conformance run. Dahl's friction creeps below its limit; Coulomb's sticks.
"""

import shutil
from pathlib import Path

import matplotlib.pyplot as plt

from tipdamp import ForcedResponse
from tipdamp.cli import main

laws = Path(__file__).parents[1] / "studies" / "own_law"
_, axes = plt.subplots()
peaks = {}
for law in ("DryFriction2T", "dahl.py:Dahl"):
    folder = Path(law.replace(":", "_"))
    main(["init", str(folder)])
    shutil.copy(laws / "dahl.py", folder)
    study = folder / "study.toml"
    chosen = f'[respond]\nlaw = "{law}"\nsearch = 0\nboth_ways = false'
    text = study.read_text().replace("[respond]", chosen).replace("[2, 10, 20]", "[5]")
    study.write_text(text.replace("harmonics = 5", "harmonics = 3"))
    for verb in ("inspect", "reduce", "preload", "tune", "respond"):
        assert main([verb, str(study), "--quiet", "--allow-code"]) == 0
    curve = ForcedResponse.load(folder / "results/study/responses/Fe_5N_H3.npz")
    curve.plot("patch_1:3", ax=axes, unit="um", label=law)
    peaks[law] = curve.peak("patch_1:3")[1]
axes.legend()

assert peaks["dahl.py:Dahl"] < peaks["DryFriction2T"]  # it dissipates where Coulomb's still sticks
