"""The site: python docs/site/build.py [FOLDER], by default build/site. Needs no network.

Pages are the documents of the repository, where they stand; added are the gallery with the pictures
that its examples draw, a page for each public name from its docstring, and the contents. Warnings
of Sphinx, such as a link that leads nowhere, are errors.
"""

import os
import re
import runpy
import shutil
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path

from api import write_api

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = Path("docs") / "gallery"
SITE = Path(__file__).resolve().parent
LINK = re.compile(r"(?<!!)\[([^\]]*)\]\(([^)#\s]+)(#[^)\s]*)?\)")
CONTENTS = {
    "Start": [
        "Start <README>",
        "docs/first_hour",
        "gallery/index",
        "docs/python",
        "docs/own_model",
        "docs/two_blade_rig",
    ],
    "How to": [
        "docs/measured_curves",
        "docs/comparison",
        "docs/sweeps",
        "docs/unlike_meshes",
        "docs/coming_from",
        "docs/studies/own_law/README",
        "docs/studies/matrices_only/README",
    ],
    "Reference": ["docs/study_files", "api/index", "docs/glossary", "CHANGELOG"],
    "Theory": ["docs/theory/*"],
    "How far to trust it": [
        "docs/limits",
        "docs/warnings",
        "docs/validation",
        "docs/reliability",
        "docs/decisions",
    ],
    "Work on it": ["CONTRIBUTING", "meshes/README"],
}
GALLERY = {  # examples that no heading names stand at the end
    "First steps": [
        "duffing",
        "friction_loops",
        "gap",
        "two_blades",
        "preload_map",
        "unlike_meshes",
        "preload_curve",
    ],
    "Your own matrices and curves": [
        *("matrices", "matrices_nastran", "matrices_ansys", "measured", "parallel_sweep"),
    ],
    "Dampers": [
        *("damper_preload", "compare_dampers", "follow_peak", "derivatives", "friction_beam"),
        *("stress_at_peak", "backbone"),
    ],
    "Excitation": ["base_motion", "rotor_unbalance", "two_orders"],
    "Laws": ["own_law_numpy", "own_law_hysteresis", "own_law_by_file", "mixed_chain"],
    "Stability and further motions": [
        *("named_points", "detached", "subharmonic", "time_integration"),
    ],
}
FRONT = """\
# tipdamp

Friction dampers between turbine blades, and any other vibration with contact, friction or springs
that are not linear: preload, tuning, forced response through folds, stability, and how far to trust
each number.

![Forced response of two blades with a damper](docs/images/forced_response.png)

- **From meshes, from matrices, from equations**: [the first hour](docs/first_hour.md)
- **A picture of what you want**: [the gallery](gallery/index.md)
- **A law of your own**: [how to write one](docs/studies/own_law/README.md)
- **Whether to trust it**: [what it cannot do](docs/limits.md), [validation](docs/validation.md),
  [reliability](docs/reliability.md)
"""


def main(folder: Path) -> None:
    """Build the site in a folder, which is made anew."""
    with tempfile.TemporaryDirectory() as made:
        source = Path(made)
        _copy_documents(source)
        _gallery(source / "gallery")
        write_api(source / "api")
        _contents(source)
        shutil.copy(SITE / "conf.py", source)
        (source / "_static").mkdir()
        shutil.copy(SITE / "site.css", source / "_static")
        shutil.rmtree(folder, ignore_errors=True)
        command = [sys.executable, "-m", "sphinx", "-b", "html", "-W", "--keep-going", "-q"]
        subprocess.run([*command, str(source), str(folder)], check=True)


def _documents() -> list[Path]:
    """The documents of the repository that are pages."""
    found = [*(ROOT / "docs").rglob("*.md"), ROOT / "meshes" / "README.md", *ROOT.glob("*.md")]
    return sorted(path.relative_to(ROOT) for path in found if "results" not in path.parts)


def _copy_documents(source):
    for path in _documents():
        text = (ROOT / path).read_text(encoding="utf-8")
        (source / path).parent.mkdir(parents=True, exist_ok=True)
        linked = LINK.sub(lambda found, page=path: _link(page, *found.groups()), text)
        known = linked.replace("```csv", "```text")  # no lexer has that name
        (source / path).write_text(known, encoding="utf-8")
    for picture in [*(ROOT / "docs").rglob("*.png"), *(ROOT / "meshes").glob("*.png")]:
        there = source / picture.relative_to(ROOT)
        there.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(picture, there)


def _link(page, text, target, anchor):
    """A link to another page as it stands; what is no page is named by its place in the
    repository."""
    place = os.path.relpath((ROOT / page).parent / target, ROOT)
    if "://" in target:
        return f"[{text}]({target}{anchor or ''})"
    if Path(place) in _documents():
        here = Path("gallery") if page.suffix == ".py" else page.parent  # its page
        return f"[{text}]({os.path.relpath(place, here)}{anchor or ''})"
    if place == "docs/gallery":
        return f"[{text}]({os.path.relpath('gallery/index.md', page.parent)})"
    return f"`{place}`" if text.strip("`") in (place, target) else f"{text} (`{place}`)"


def _gallery(folder):
    """A page with code and picture for each example, and one with all of them."""
    import matplotlib.pyplot as plt

    folder.mkdir()
    plt.switch_backend("agg")
    cards = {}
    for path in sorted((ROOT / EXAMPLES).glob("*.py")):
        text = path.read_text(encoding="utf-8")
        title, said = text.split('"""')[1].strip().split("\n\n", 1)
        picture = folder / f"{path.stem}.png"
        _run(path, picture)
        code = text.split('"""', 2)[2].strip()
        said = LINK.sub(lambda found: _link(EXAMPLES / "x.py", *found.groups()), said)
        page = f"# {title}\n\n{said}\n\n![{title}]({picture.name})\n\n```python\n{code}\n```\n"
        (folder / f"{path.stem}.md").write_text(page, encoding="utf-8")
        link = f"**[{title}]({path.stem}.md)**"
        cards[path.stem] = (
            f":::{{container}} card\n![{title}]({picture.name})\n\n{link}\n\n{said}\n:::"
        )
    lines = ["# Gallery", "", "Short examples, each of which the tests run.", ""]
    named = {stem for stems in GALLERY.values() for stem in stems}
    groups = GALLERY | {"More": sorted(set(cards) - named)}
    for heading, stems in groups.items():
        if stems:
            inside = "\n\n".join(cards[stem] for stem in stems)
            lines += [f"## {heading}", "", f"::::{{container}} cards\n{inside}\n::::", ""]
    lines += ["```{toctree}", ":hidden:", ""]
    lines += [*(stem for stems in groups.values() for stem in stems), "```", ""]
    (folder / "index.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


def _run(path, picture):
    """Run an example in a folder of its own; its figure becomes the picture."""
    import matplotlib.pyplot as plt

    before = Path.cwd()
    with tempfile.TemporaryDirectory() as aside, warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        os.chdir(aside)
        try:
            runpy.run_path(str(path))
            plt.gcf().savefig(picture, dpi=110)
        finally:
            os.chdir(before)
            plt.close("all")


def _contents(source):
    """The front page; documents that no heading names stand at the end."""
    lines = [FRONT]
    named = set()
    for heading, entries in CONTENTS.items():
        lines += ["```{toctree}", ":hidden:", f":caption: {heading}", ""]
        for entry in entries:
            if entry.endswith(">"):  # a name of its own
                lines.append(entry)
                named.add(source / f"{entry.split('<')[1][:-1]}.md")
                continue
            found = sorted(source.glob(f"{entry}.md"))
            lines += [path.relative_to(source).with_suffix("").as_posix() for path in found]
            named |= set(found)
        lines += ["```", ""]
    rest = {source / path for path in _documents()} - named
    lines += ["```{toctree}", ":hidden:", ":caption: More", ""]
    lines += sorted(path.relative_to(source).with_suffix("").as_posix() for path in rest)
    (source / "index.md").write_text("\n".join([*lines, "```", ""]), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "build" / "site")
