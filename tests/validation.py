"""docs/validation.md and docs/validation/*.md from the numbers of the tests: every case beside its reference.

    OMP_NUM_THREADS=1 python -m tests.validation                 all sections (a few minutes)
    OMP_NUM_THREADS=1 python -m tests.validation oscillator e    these sections, the others as they stand
    OMP_NUM_THREADS=1 python -m tests.validation --front         the front page alone, from the pages that stand

A section is a page of rows (case, H or '', ours, reference, relative error, against); its worst row for each kind of
reference goes to the front page beside what is allowed. Sections live with their tests: the modules of MODULES hold
them. Benchmarks write their own figures into tests/benchmarks/results, from which `tests/validation_figures.py` makes
the tables of speed and robustness.
"""

import datetime
import importlib
import importlib.metadata
import platform
import sys
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[1]
FRONT, PAGES = ROOT / "docs" / "validation.md", ROOT / "docs" / "validation"
MODULES = ("tests.hbm.validation_rows", "tests.hbm.validation_truth", "tests.modal.validation_rows",
           "tests.static_contact.validation_rows", "tests.static_contact.validation_h1")
HEADER = "| case | H | ours | reference | error | against |"


@dataclass(frozen=True)
class Section:
    """One page of rows.

    key : name of the page; title, text : what is compared, in which quantity, and the source of the reference
    rows : function without arguments that yields (case, H or '', ours, reference, relative error, against)
    allowed : {against: largest error}; a key may be the beginning of an `against`
    """

    key: str
    title: str
    text: str
    rows: object
    allowed: dict = field(default_factory=dict)

    def limit(self, against):
        """What is allowed against a kind of reference; None where nothing is asked."""
        fits = [k for k in self.allowed if against.startswith(k)]
        return self.allowed[max(fits, key=len)] if fits else None


def sections() -> list[Section]:
    """Of every module that is there, in the order of MODULES."""
    found = []
    for name in MODULES:
        if (ROOT / (name.replace(".", "/") + ".py")).exists():
            found += importlib.import_module(name).SECTIONS
    return found


def relative(ours, reference) -> float:
    return abs(ours - reference) / max(abs(reference), 1e-300)


def made() -> str:
    """Date, versions and machine of what is computed now."""
    versions = [f"{p} {importlib.metadata.version(p)}" for p in ("numpy", "scipy", "numba")]
    return f"{datetime.date.today()}; Python {platform.python_version()}, {', '.join(versions)}; {processor()}"


def processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.machine()


def page(section: Section, rows, when: str) -> str:
    """Markdown of a section: its worst rows, then all."""
    lines = [f"# {section.title}", "", section.text, "", f"Computed {when}. [All sections](../validation.md)", "",
             "Worst of each kind:", "", HEADER, "|---|---|---|---|---|---|", *map(_line, worst(rows)), "", "All rows:",
             "", HEADER, "|---|---|---|---|---|---|", *map(_line, rows)]
    return "\n".join(lines) + "\n"


def _line(row):
    case, H, ours, reference, error, against = row
    return f"| {case} | {H} | {_number(ours)} | {_number(reference)} | {_number(error, '.1e')} | {against} |"


def _number(value, layout=".9g"):
    return value if isinstance(value, str) else format(value, layout)


def worst(rows) -> list:
    """The row of largest error for each `against`, in the order in which these come."""
    found = {}
    for row in rows:
        if row[5] not in found or not float(row[4]) <= float(found[row[5]][4]):
            found[row[5]] = row
    return list(found.values())


def read_page(key: str):
    """(when, rows) of a page as it stands; the numbers stay text. None where there is no page."""
    path = PAGES / f"{key}.md"
    if not path.exists():
        return None
    text = path.read_text(encoding="utf-8")
    when = text.split("Computed ")[1].split(". [All")[0]
    table = text.split("All rows:")[1].splitlines()
    return when, [tuple(cell.strip() for cell in line.strip("|").split("|")) for line in table
                  if line.startswith("|") and not line.startswith(("|---", "| case"))]


def front() -> str:
    """The front page, from the pages and benchmark figures that stand."""
    from tests import validation_figures
    lines, missed, promises = [], [], 0
    for s in sections():
        when, rows = read_page(s.key) or ("", [])
        title, date = f"[{s.title}](validation/{s.key}.md)", when[:10]
        shown = [row for row in worst(rows) if s.limit(row[5]) is not None] or worst(rows)
        for case, H, _, _, error, against in shown:
            limit = s.limit(against)
            met = limit is None or float(error) <= limit
            allowed = "" if limit is None else f"{limit:.2g}" if met else f"**{limit:.2g}**"
            lines.append(f"| {title} | {against} | {case} | {H} | {error} | {allowed} | {date} |")
            title = date = ""
            promises += limit is not None
            if not met:
                missed.append(f"- {s.title}, against {against}: {error}, promised {limit:.2g} ({case})")
        if not rows:
            lines.append(f"| {s.title} | not computed yet | | | | | |")
    misses, figures = validation_figures.front()
    known = {s.key for s in sections()} | set(validation_figures.pages())
    others = sorted(path for path in PAGES.glob("*.md") if path.stem not in known)
    links = "; ".join(f"[{path.read_text(encoding='utf-8').split(chr(10))[0].lstrip('# ')}](validation/{path.name})"
                      for path in others)
    return "\n".join([
        FRONT_TEXT, f"Of {promises} promises on accuracy and those on speed and robustness these are missed:", "",
        *(missed + misses or ["- none"]), "", "## Accuracy", "",
        "| section | against | worst case | H | error | allowed | computed |", "|---|---|---|---|---|---|---|", *lines,
        *(["", f"Pages of their own: {links}."] if links else []), "", figures, DISAGREEMENTS])


FRONT_TEXT = """# Validation

Made by `python -m tests.validation`, from the cases of the tests; not edited by hand. Each line is the **worst** row of
its section against one kind of reference, as a relative error; the title leads to the page with all rows, its date, its
versions and the source of the reference. *allowed* is what is promised; bold: the worst row exceeds it. Comparisons
without a promise (fewer harmonics, coarser meshes) are on the pages.
"""

DISAGREEMENTS = """## Where a reference and two of our own routes disagree

- **D1 at Om = 1.5** (the pair opens): the harmonic-balance table is good to 4e-5 on the dof that moves more, but off by
  1.1e-4 on the other. A third computation, plain sampling that locates no instant and shares no code with `hbm`, gives
  the table to rounding at 4096 samples and goes to our numbers when the samples are refined (rows "refined" of page
  [D](validation/d.md)): a sampled slider begins at the first *sample* in contact, not at the instant of contact, an
  error of first order. At equal H ours are right; at H = 40 they meet the exact orbit.
"""


def main(arguments):
    PAGES.mkdir(exist_ok=True)
    chosen = sections()
    keys = [a for a in arguments if a != "--front"]
    unknown = set(keys) - {s.key for s in chosen}
    if unknown:
        sys.exit(f"no section '{unknown.pop()}'; there are: {', '.join(s.key for s in chosen)}")
    for s in chosen:
        if "--front" in arguments or (keys and s.key not in keys):
            continue
        print(s.key, flush=True)
        rows = list(s.rows())
        (PAGES / f"{s.key}.md").write_text(page(s, rows, made()), encoding="utf-8")
    from tests import validation_figures
    for key, text in validation_figures.pages().items():
        (PAGES / f"{key}.md").write_text(text, encoding="utf-8")
    FRONT.write_text(front(), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
