"""The validation pages of a release: a page a subject; worst.md: what misses its limit, and the
worst rows.

    OMP_NUM_THREADS=1 python -m tests.validation [--out build/validation] [--long] [SUBJECT ...]

worst.md goes into docs/validation.md as its chapter on accuracy. All subjects: about a quarter of
an hour.
"""

import argparse
import importlib
import platform
import shutil
import subprocess
from datetime import date
from importlib import metadata
from pathlib import Path

ROOT = Path(__file__).parents[2]
SUBJECTS = (
    "jenkins_closed_form",
    "rigid_friction",
    "lift_off",
    "coupled_friction",
    "friction_in_the_plane",
    "planar_oscillator",
    "frictional_beam",
    "held_wedge",
    "time_integration",
    "rig_time_integration",
    "craig_bampton",
    "nafems",
    "rotating_beam",
    "supported_beams",
    "random_beams",
    "random_oscillators",
    "stuck_modes",
    "contact_stiffness",
    "hertz",
    "peaks_from_both_ends",
    "random_residuals",
    "trusted_curves",
    "nonlinear_modes",
    "following",
    "derivatives",
    "general_problem",
    "three_dampers",
)


def made() -> str:
    """Date, versions and commit of what is computed now."""
    versions = ", ".join(f"{name} {metadata.version(name)}" for name in ("numpy", "scipy", "numba"))
    commit = (
        ""
        if shutil.which("git") is None
        else subprocess.run(
            ["git", "describe", "--always", "--dirty"], cwd=ROOT, capture_output=True, text=True
        ).stdout.strip()
    )
    return (
        f"{date.today()}; Python {platform.python_version()}, {versions}; commit "
        f"{commit or 'unknown'}"
    )


def worst(rows) -> list:
    """The row of largest error against each kind of reference."""
    found = {}
    for row in rows:
        if row.against not in found or not row.error <= found[row.against].error:
            found[row.against] = row
    return list(found.values())


def allowed(subject, row) -> str:
    limit = subject.limit(row.against)
    return "" if limit is None else f"{limit:.2g}" + " **missed**" * (not row.error <= limit)


def table(subject, rows) -> list[str]:
    lines = ["| case | ours | reference | error | against | limit |", "|---|---|---|---|---|---|"]
    for row in rows:
        values = " | ".join(
            v if isinstance(v, str) else f"{v:.9g}" for v in (row.ours, row.reference)
        )
        lines.append(
            f"| {row.case} | {values} | {row.error:.1e} | {row.against} | {allowed(subject, row)} |"
        )
    return lines


def missed(subject, rows) -> list[str]:
    """A line for each kind of reference with rows beyond the limit: asked, measured, and why."""
    lines = []
    for worst_row in worst(rows):
        kind, limit = worst_row.against, subject.limit(worst_row.against)
        if limit is None or worst_row.error <= limit:
            continue
        these = [row.error <= limit for row in rows if row.against == kind]
        why = subject.misses[kind].why if kind in subject.misses else "not known"
        lines.append(
            f"- **missed**: {subject.title}, {kind}: asked {limit:.2g}, measured "
            f"{worst_row.error:.1e} ({worst_row.case}; {sum(these)} of {len(these)} rows are "
            f"within); why: {why}"
        )
    return lines


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "validation")
    parser.add_argument("--long", action="store_true", help="the rows that take minutes, too")
    parser.add_argument("subjects", nargs="*", metavar="SUBJECT", help=", ".join(SUBJECTS))
    asked = parser.parse_args(arguments)
    if unknown := set(asked.subjects) - set(SUBJECTS):
        parser.error(f"no subject '{unknown.pop()}'; there are: {', '.join(SUBJECTS)}")
    asked.out.mkdir(parents=True, exist_ok=True)
    falls_short = []
    index = ["| subject | against | worst case | error | limit |", "|---|---|---|---|---|"]
    for name in asked.subjects or SUBJECTS:
        print(name, flush=True)
        subject = importlib.import_module(f"tests.validation.{name}").SUBJECT
        rows = list(subject.long() if asked.long and subject.long else subject.rows())
        short = missed(subject, rows)
        page = [
            f"# {subject.title}",
            "",
            subject.text,
            "",
            f"{made()}.",
            "",
            *short,
            *[""] * bool(short),
            *table(subject, rows),
        ]
        (asked.out / f"{name}.md").write_text("\n".join(page) + "\n", encoding="utf-8")
        index += [
            f"| {subject.title} | {row.against} | {row.case} | {row.error:.1e} | "
            f"{allowed(subject, row)} |"
            for row in worst(rows)
        ]
        falls_short += short
    index = [f"Computed {made()}.", "", *(falls_short or ["- every limit is met"]), "", *index]
    (asked.out / "worst.md").write_text("\n".join(index) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
