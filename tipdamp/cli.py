"""Command line: `tipdamp VERB STUDY`. The only place that prints results and sets exit codes.

0 done; 1 done, but a curve is incomplete; 2 the input cannot be used; 3 a solver gave up;
130 interrupted.
"""

import argparse
import logging
import sys
import time

import tipdamp
from hbm.errors import InputError, shown
from tipdamp.kernel_cache import choose_kernel_cache


def main(argv=None) -> int:
    """Run the command line; returns the exit code."""
    choose_kernel_cache()
    parser = _parser()
    if not (sys.argv[1:] if argv is None else argv):
        parser.print_help()
        return 2
    arguments = parser.parse_args(argv)
    logging.basicConfig(format="%(message)s")  # before the libraries that put their names in front
    logging.getLogger().setLevel(logging.WARNING)  # compilers of forms and kernels talk on the root logger
    try:
        return arguments.run(arguments)
    except InputError as error:
        print(f"tipdamp: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"tipdamp: {error.filename or ''}: {error.strerror or error}", file=sys.stderr)
        return 2
    except ModuleNotFoundError as error:
        print(f"tipdamp: {error.name} is not installed, and this job needs it; run: tipdamp doctor", file=sys.stderr)
        return 2
    except RuntimeError as error:
        print(f"tipdamp: could not be solved: {' '.join(str(error).split())}", file=sys.stderr)
        return 3
    except KeyboardInterrupt:
        print("tipdamp: interrupted; finished stages are kept, run the same command to go on", file=sys.stderr)
        return 130


def _parser() -> argparse.ArgumentParser:
    from tipdamp.stages.run import STAGES

    parser = argparse.ArgumentParser(prog="tipdamp", description="Friction pin dampers between turbine blade tips: "
                                     "preload map, detachment tuning, forced response.")
    parser.add_argument("--version", action="version", version=f"tipdamp {tipdamp.__version__}")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    for name, text, run in [*((s.name, s.text, _one_stage) for s in STAGES.values()),
                            ("run", "all stages, from the meshes to the report", _all_stages)]:
        verb = verbs.add_parser(name, help=text, description=text)
        verb.add_argument("study", help="study file (.toml)")
        verb.add_argument("--out", help="results folder (default: results/<study name> beside the study)")
        verb.add_argument("--force", action="store_true", help="run even when nothing has changed")
        verb.add_argument("--quiet", action="store_true", help="no progress")
        verb.set_defaults(run=run)
    export = verbs.add_parser("export", help="the reduced model of a study as .npz, .mat or Matrix Market")
    export.add_argument("study", help="study file (.toml), reduced before")
    export.add_argument("--out", help="results folder, as for the other verbs")
    export.add_argument("--format", default="mtx", help="npz, mat or mtx (default)")
    export.set_defaults(run=_export)
    doctor = verbs.add_parser("doctor", help="what is missing or wrong on this machine, with the repair")
    doctor.set_defaults(run=_doctor)
    keys = verbs.add_parser("keys", help="every key of a study file: unit, default, range and meaning")
    keys.set_defaults(run=_keys)
    return parser


def _keys(_) -> int:
    from tipdamp.study.keys import reference

    print(reference(), end="")
    return 0


def _export(arguments) -> int:
    from hbm.io.matrices_out import write_model
    from hbm.model import ReducedModel
    from tipdamp.stages.run import results_folder
    from tipdamp.study.study import load_study

    study = load_study(arguments.study)
    store = results_folder(study, arguments.out)
    if not store.path("model.npz").is_file():
        raise InputError(f"{arguments.study}: nothing to export yet; run: tipdamp reduce {arguments.study}")
    for planted in store.path("export").glob("*"):
        store.path(f"export/{planted.name}")  # a link that leads out would be written through
    for path in write_model(ReducedModel.load(store.path("model.npz")), store.path("export"), arguments.format):
        print(path)
    return 0


def _doctor(_) -> int:
    from tipdamp.doctor import checks, report

    found = checks()
    print(report(found))
    return 1 if any(c.status == "fail" for c in found) else 0


def _one_stage(arguments) -> int:
    from tipdamp.stages.run import results_folder, run_stage
    from tipdamp.study.study import load_study

    study = load_study(arguments.study)
    store = results_folder(study, arguments.out)
    how = run_stage(arguments.verb, study, store, force=arguments.force, quiet=arguments.quiet)
    print(_line(arguments.verb, how, study, store))
    return _partial(store) if arguments.verb == "respond" else 0


def _all_stages(arguments) -> int:
    from tipdamp.stages.run import STAGES, missing_sections, results_folder, run_stage
    from tipdamp.study.study import load_study

    study = load_study(arguments.study)
    store = results_folder(study, arguments.out)
    began = time.perf_counter()
    for name in STAGES:
        missing = missing_sections(name, study)
        if missing:
            print(f"{name:8s}    nothing to do: the study has no [{'], ['.join(missing)}]")
            continue
        how = run_stage(name, study, store, force=arguments.force, quiet=arguments.quiet)
        print(_line(name, how, study, store), flush=True)
    print(f"report: {store.path('report.html')}  ({time.perf_counter() - began:.1f} s)")
    return _partial(store)


def _line(name, how, study, store) -> str:
    from tipdamp.stages.summaries import highlight, warnings

    seconds = store.record(name)["seconds"]
    when = "up to date" if how == "skipped" else f"{seconds:.1f} s"
    found = store.read_json(f"{name}.json") if name != "report" else {}
    said = [f"warning: {shown(w, 400)}" for w in warnings(name, study, found)]
    return "\n".join([f"{name:8s} {when:>10s}  {highlight(name, store)}", *said])


def _partial(store) -> int:
    if store.record("respond") is None:
        return 0
    found = store.read_json("respond.json")["responses"]
    curves = [*found, *(r["back"] for r in found if "back" in r)]
    incomplete = sum(not r["complete"] or r["failed_points"] > 0 for r in curves)
    if incomplete:
        print(f"tipdamp: {incomplete} of {len(curves)} curves are incomplete, see the report", file=sys.stderr)
    return 1 if incomplete else 0
