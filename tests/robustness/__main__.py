"""docs/reliability.md: every row of the catalogue with what was answered, and the counts of the
long runs.

    python -m tests.robustness [--out docs/reliability.md]

The long runs: python -m tests.robustness.fuzz, .kills, .flips, tests.validation.random_residuals.
"""

import argparse
import tempfile
import traceback
from pathlib import Path

from tests.robustness import counts
from tests.robustness.suite import ROWS
from tests.validation.__main__ import ROOT, made

HEAD = """# Reliability

Made by `./dev reliability` from `tests/robustness`: every row of the
[catalogue of bad inputs](../tests/reference/robustness/bad-inputs.md) is a real file or fault, and
is answered as its last column says, but for rows 73 and 77 (stages are skipped or made again, and
what has changed is named), 88 (inputs outside the folder are read and named, outputs outside
refused) and 71 (at most 10 s of a running curve are lost). Rows x.. stand beside the catalogue.

E: refused in one line before anything heavy; W: run, with a warning that is also in the results;
S: run, with the stated answer; R: recovered.

| exit code | meaning |
|---|---|
| 0 | done |
| 2 | the input cannot be used |
| 3 | a solver gave up, or a curve is incomplete |
| 4 | this machine does not allow it: memory, disk, a missing package, a results folder in use |
| 130, 143 | interrupted (Ctrl-C), terminated (SIGTERM); the same command goes on |
"""


def answers(row) -> tuple[list[str], bool]:
    """(what was answered, whether it was as asked)"""
    with tempfile.TemporaryDirectory(prefix="tipdamp-") as folder:
        try:
            return [
                text.replace(folder + "/", "").replace(folder, "...")
                for text in row.check(Path(folder))
            ], True
        except Exception:
            return [traceback.format_exc().splitlines()[-1]], False


def cell(text: str) -> str:
    """Text in a table of Markdown."""
    text = text if len(text) < 260 else text[:257] + "..."
    return "`" + text.replace("`", "'").replace("|", "\\|") + "`"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "reliability.md")
    table = ["| row | fault | class | answered |", "|---|---|---|---|"]
    good = 0
    shown = 0
    out = parser.parse_args().out
    for row in ROWS:
        said, fine = answers(row)
        good, shown = good + fine, shown + len(said)
        print(f"{row.number:4s} {'ok' if fine else 'NOT AS ASKED'}  {row.fault}", flush=True)
        table.append(
            f"| {row.number} | {row.fault} | {row.asked} | {'' if fine else '**not as asked** '}"
            f"{'<br>'.join(map(cell, said))} |"
        )
    long = ["| run | date | counts |", "|---|---|---|"]
    for run, figures in counts.read().items():
        told = "; ".join(
            f"{name.replace('_', ' ')}: {value}"
            for name, value in figures.items()
            if name != "date"
        )
        long.append(f"| {run} | {figures['date']} | {told} |")
    text = [
        HEAD,
        f"Computed {made()}. **{good} of {len(ROWS)} rows are answered as asked**, {shown} "
        "answers.",
        "",
        "## The long runs",
        "",
        *long,
        "",
        "## Rows",
        "",
        *table,
        "",
    ]
    out.write_text("\n".join(text), encoding="utf-8")


if __name__ == "__main__":
    main()
