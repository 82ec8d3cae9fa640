"""What the stages of a run leave: records and files, below the stages. In the order of a run, what
each does:"""

STAGES = {
    "inspect": "what is in the meshes: groups, counts, masses, rigid modes",
    "reduce": "meshes to a reduced model and contact pairs; modes without damper",
    "preload": "unilateral static contact under the pull: the preload map",
    "measured": "reads measured curves: mean and band of the repeats, peaks, damping",
    "tune": (
        "selects what is kept: detaches stations or area until the stuck frequency meets its "
        "target, or as given"
    ),
    "respond": "forced response at every level and number of harmonics",
    "cycles": "hysteresis loops, friction work and energy balance at the peak of every curve",
    "stress": (
        "mean and alternating stress of the whole bodies at the peaks, where [respond] stress "
        "asks for it"
    ),
    "agreement": "sets the computed curves beside the measured ones",
    "fit": "damping fitted to the measured curves with the contacts in the model, where [fit] asks",
    "backbone": "a nonlinear mode over its amplitude, where [backbone] asks for it",
    "report": "the HTML page, the figures and summary.json",
}
# not part of a run
ON_REQUEST = {"full": "the preload by Newton on the unreduced bodies (preload --full)"}
