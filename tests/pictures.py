"""What the scripts that draw pictures of the documents have in common."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path


def write_pictures(pictures: Mapping[str, Callable], folder: str | Path, names: Iterable[str]):
    """Those of these names into a folder, without a screen; pictures : {name: draws it, given
    pyplot and the file}."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    for name in names:
        pictures[name](plt, Path(folder) / f"{name}.png")
        plt.close("all")
