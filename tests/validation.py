"""docs/validation.md and docs/validation/*.md from the numbers of the tests: every case beside its reference.

    OMP_NUM_THREADS=1 python -m tests.validation                 all sections (a few minutes)
    OMP_NUM_THREADS=1 python -m tests.validation oscillator e    these sections, the others as they stand
    OMP_NUM_THREADS=1 python -m tests.validation --front         benchmarks and front page alone, rows as they stand

A section is a page of rows (case, H or '', ours, reference, relative error, against); its worst row for each kind of
reference goes to the front page beside what is allowed. Sections live with their tests: the modules of MODULES hold
them. Benchmarks (all: `python -m tests.benchmarks`) write figures into results/; `tests/validation_figures.py` makes
their pages, `tests/validation_targets.py` the front page's table of everything that was promised. Every page says on
which code its figures were measured, and the front page where that is not the code as it is (`validation_code.py`).
"""

import datetime
import importlib
import importlib.metadata
import platform
import sys
from dataclasses import dataclass, field, replace
from pathlib import Path

from tests import validation_code
from tests.benchmarks.record import RUNS, fingerprint, recorded

ROOT = Path(__file__).parents[1]
FRONT, PAGES = ROOT / "docs" / "validation.md", ROOT / "docs" / "validation"
MODULES = {"tests.hbm.validation_rows": "hbm", "tests.hbm.validation_truth": "hbm",
           "tests.modal.validation_rows": "statics", "tests.static_contact.validation_rows": "statics",
           "tests.static_contact.validation_h1": "statics"}
"""{module: the code that its rows run, a key of record.PACKAGES}"""
HEADER = "| case | H | ours | reference | error | against |"


@dataclass(frozen=True)
class Section:
    """One page of rows.

    key : name of the page; title, text : what is compared, in which quantity, and the source of the reference
    rows : function without arguments that yields (case, H or '', ours, reference, relative error, against)
    allowed : {against: largest error}; a key may be the beginning of an `against`
    store : name of the figures that a benchmark measured; None: the rows are computed now
    notes : function without arguments that gives markdown to stand below the text
    code : key of record.PACKAGES, filled in by `sections`
    """

    key: str
    title: str
    text: str
    rows: object
    allowed: dict = field(default_factory=dict)
    store: str | None = None
    notes: object = None
    code: str = "hbm"

    def limit(self, against):
        """What is allowed against a kind of reference; None where nothing is asked."""
        fits = [k for k in self.allowed if against.startswith(k)]
        return self.allowed[max(fits, key=len)] if fits else None


def sections() -> list[Section]:
    """Of every module that is there, in the order of MODULES."""
    found = []
    for name, code in MODULES.items():
        if (ROOT / (name.replace(".", "/") + ".py")).exists():
            found += [replace(s, code=RUNS.get(s.store, code)) for s in importlib.import_module(name).SECTIONS]
    return found


def relative(ours, reference) -> float:
    return abs(ours - reference) / max(abs(reference), 1e-300)


def made(code: str) -> str:
    """Date, versions, machine and code of what is computed now."""
    versions = [f"{p} {importlib.metadata.version(p)}" for p in ("numpy", "scipy", "numba")]
    return (f"{datetime.date.today()}; Python {platform.python_version()}, {', '.join(versions)}; {processor()}; "
            f"code {fingerprint(code)}")


def processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.machine()


def page(section: Section, rows, when: str) -> str:
    """Markdown of a section: its worst rows beside what is promised, then all."""
    lines = [f"# {section.title}", "", section.text, "", f"Computed {when}. [All sections](../validation.md)", ""]
    lines += validation_code.warning(when, section.code, validation_code.now())
    if section.notes:
        lines += [section.notes(), ""]
    if not rows:
        return "\n".join([*lines, "Not measured.", "", "All rows:"]) + "\n"
    lines += ["Worst of each kind:", "", HEADER + " promised | held |", "|---" * 8 + "|"]
    lines += [_line(row) + _promise(section, row) for row in worst(rows)]
    lines += ["", "All rows:", "", HEADER, "|---" * 6 + "|", *map(_line, rows)]
    return "\n".join(lines) + "\n"


def _promise(section, row):
    """Two cells: what is promised against this kind of reference, and whether it is held."""
    limit = section.limit(row[5])
    return " |  |" if limit is None else f" {limit:.2g} | {'yes' if float(row[4]) <= limit else '**NO**'} |"


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


def front(codes=None) -> str:
    """The front page, from the pages and benchmark figures that stand; codes: of which code, else of that as it is."""
    from tests import validation_figures, validation_targets
    codes = codes or validation_code.now()
    marks = code_marks(codes)
    targets = {"The harmonic-balance core": validation_targets.hbm(),
               "Statics and reduction": validation_targets.statics()}
    every = [t for part in targets.values() for t in part]
    short = validation_targets.short(every)
    held = sum(t.held is True for t in every)
    tables = [line for title, part in targets.items() for line in (f"### {title}", "",
                                                                   *validation_targets.lines(part, marks))]
    return "\n".join([
        FRONT_TEXT, validation_code.sentence(codes), "", "## What falls short", "",
        f"Of {sum(t.held is not None for t in every)} promises that were measured {held} are held.", "",
        *(short or ["- nothing"]), "", "## Measured on other code", "", *_stale_lines(marks), "", "## Promises", "",
        *tables, "## Sections", "", SECTIONS_TEXT, "",
        "| section | against | worst case | H | error | allowed | computed |", "|---|---|---|---|---|---|---|",
        *_section_lines(marks), "", f"Benchmarks: {_links(validation_figures.pages())}.", "", *_pages_of_their_own(),
        DISAGREEMENTS])


def code_marks(codes) -> dict:
    """{key of a page: what to say of the code that its figures are of; '' where it is that of `codes`}."""
    from tests import validation_figures
    found = {s.key: ((read_page(s.key) or ("", []))[0], s.code) for s in sections()}
    found |= {key: (validation_code.described(recorded(store)), RUNS[store])
              for key, store in validation_figures.STORES.items()}
    return {key: validation_code.mark(*at, codes) for key, at in found.items()}


def _stale_lines(marks):
    """A bullet for each kind of mark, with its pages."""
    kinds = sorted(set(filter(None, marks.values())))
    return [f"- {kind}: {_links([key for key in marks if marks[key] == kind])}" for kind in kinds] or ["- nothing"]


def _section_lines(marks):
    """The worst rows of every section; one that has no rows says so."""
    for s in sections():
        when, rows = read_page(s.key) or ("", [])
        title, date = f"[{s.title}](validation/{s.key}.md)", when[:10]
        if marks.get(s.key):
            date = f"**{marks[s.key]}**"
        for case, H, _, _, error, against in [r for r in worst(rows) if s.limit(r[5]) is not None] or worst(rows):
            limit = s.limit(against)
            allowed = "" if limit is None else f"{limit:.2g}" if float(error) <= limit else f"**{limit:.2g}**"
            yield f"| {title} | {against} | {case} | {H} | {error} | {allowed} | {date} |"
            title = date = ""
        if not rows:
            yield f"| {s.title} | **not measured** | | | | | |"


def _pages_of_their_own():
    """A line that links the pages that no section makes."""
    from tests import validation_figures
    known = {s.key for s in sections()} | set(validation_figures.pages())
    others = [path.stem for path in sorted(PAGES.glob("*.md")) if path.stem not in known]
    return [f"Pages of their own: {_links(others)}.", ""] if others else []


def _links(keys):
    titles = {key: (PAGES / f"{key}.md").read_text(encoding="utf-8").split("\n")[0].lstrip("# ") for key in keys
              if (PAGES / f"{key}.md").exists()}
    return "; ".join(f"[{title}](validation/{key}.md)" for key, title in titles.items())


FRONT_TEXT = """# Validation

Made by `python -m tests.validation`, from the cases of the tests and the last run of the benchmarks
(`python -m tests.benchmarks`); not edited by hand. Every promise stands below with what was measured; the link leads to
the page with all rows, its date, its versions, its code and the source of the reference. A figure that was measured on
other code than this page was made for says so in the column *code*.
"""

SECTIONS_TEXT = """Each line is the **worst** row of a section against one kind of reference, as a relative error;
*allowed* is the limit that the suite holds this page to, bold where the row exceeds it. Comparisons without a limit
(fewer harmonics, coarser meshes) are on the pages."""

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
        when, rows = validation_code.described(recorded(s.store)) if s.store else "", []
        if s.store:                             # a benchmark's figures are only read
            rows = list(s.rows())
        elif "--front" in arguments or (keys and s.key not in keys):
            when, rows = read_page(s.key) or ("never", [])
        else:
            print(s.key, flush=True)
            when, rows = made(s.code), list(s.rows())
        (PAGES / f"{s.key}.md").write_text(page(s, rows, when), encoding="utf-8")
    from tests import validation_figures
    for key, text in validation_figures.pages().items():
        (PAGES / f"{key}.md").write_text(text, encoding="utf-8")
    FRONT.write_text(front(), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
