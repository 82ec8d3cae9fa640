"""Command line: `tipdamp VERB STUDY`. The only place that prints results and sets exit codes.

0 done; 2 the input cannot be used; 3 a solver gave up, or a curve is incomplete; 4 this machine
does not allow it: memory, disk or a package is short, or another run uses the results folder; 130
interrupted (Ctrl-C), 143 terminated (SIGTERM). The same where stderr is closed or cannot be written
to: its messages are lost, not the work.
"""

import argparse
import errno
import io
import logging
import os
import resource
import signal
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import tipdamp
from tipdamp.engine import ranks
from tipdamp.engine.kernel_cache import choose_caches
from tipdamp.hbm.errors import Doubt, InputError, shown
from tipdamp.report.libraries import MissingLibrary
from tipdamp.results import STAGES
from tipdamp.stages import receipts

if TYPE_CHECKING:
    from tipdamp.engine.store import Store
    from tipdamp.engine.workers import Workers
    from tipdamp.study.view import Study
    from tipdamp.sweep.estimate import SweepEstimate

LEAST_ADDRESSES = 1_000_000_000  # bytes of address space, into which the libraries fit
LONGEST_LINE = 4000  # letters of a message
PARALLEL = ("respond", "report")  # stages that may use processes; known before stages are loaded
KEPT = (
    "finished stages and curves are kept, and what running curves have; run the same command to "
    "continue"
)


class Terminated(KeyboardInterrupt):
    """SIGTERM: what is begun is put aside, as after Ctrl-C."""


def command() -> None:
    """The installed command: `main`, then exit. Never returns.

    A signal that comes while the interpreter is taken down finds the work done: it must not turn it
    into a failure."""
    _open_streams()
    code = main()
    for late in (signal.SIGINT, signal.SIGTERM):
        signal.signal(late, signal.SIG_IGN)
    sys.exit(code)


class _Lossy(io.TextIOWrapper):
    """Text that cannot be written is lost, and the work goes on."""

    losses: type[OSError] = OSError

    def write(self, text: str) -> int:
        with suppress(self.losses):
            super().write(text)
        return len(text)

    def flush(self) -> None:
        with suppress(self.losses):
            super().flush()


class _Unread(_Lossy):
    """Text into a pipe whose reader has left, as `head` does, is lost; a full disk is not."""

    losses = BrokenPipeError


def _open_streams() -> None:
    """Streams that are closed lead nowhere: a file that is opened would take their place, and the
    messages of the libraries with it."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number: this one
    out = sys.stdout.buffer if sys.stdout else open(1, "wb", closefd=False)
    encoding = sys.stdout.encoding if sys.stdout else None
    sys.stdout = _Unread(out, encoding, line_buffering=os.isatty(1))
    there = sys.stderr.buffer if sys.stderr else open(2, "wb", closefd=False)
    sys.stderr = _Lossy(there, errors="backslashreplace", line_buffering=True)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code."""
    before = signal.signal(signal.SIGTERM, _terminate)
    try:
        return _main(argv)
    except Terminated:  # while libraries are loaded, too
        return _complain(f"terminated; {KEPT}", 143)
    except KeyboardInterrupt:
        return _complain(f"interrupted; {KEPT}", 130)
    finally:
        signal.signal(signal.SIGTERM, before)


def _terminate(*_: Any) -> NoReturn:
    raise Terminated


def _main(argv: Sequence[str] | None) -> int:
    if 0 <= (limit := resource.getrlimit(resource.RLIMIT_AS)[0]) < LEAST_ADDRESSES:
        return _complain(
            f"not enough memory: the address space of this shell is limited to {limit / 1e6:.0f} "
            f"MB, the libraries alone need {LEAST_ADDRESSES / 1e6:.0f} MB; run: ulimit -v "
            "unlimited",
            4,
        )
    choose_caches()
    parser = _parser()
    if not (sys.argv[1:] if argv is None else argv):
        parser.print_help()
        return 2
    arguments = parser.parse_args(argv)
    over_ranks = vars(arguments).get("full", False)
    if ranks.count() > 1 and (ranks.number() or not over_ranks):
        return _beside(arguments) if over_ranks else _alone(arguments)
    if receipt := _kept(arguments):
        for text in receipt.said:
            print(text, flush=True)
        return _complain(receipt.complaint, receipt.code) if receipt.complaint else receipt.code
    logging.basicConfig()  # before the libraries that put their names in front
    for handler in logging.getLogger().handlers:
        handler.setFormatter(_OneLine())
    # compilers of forms and kernels log on the root logger
    logging.getLogger().setLevel(logging.WARNING)
    with warnings.catch_warnings():
        warnings.showwarning = lambda message, *_, **__: logging.getLogger("tipdamp").warning(
            "%s", message.args[0] if isinstance(message, Doubt) else message
        )
        return _answered(arguments)


def _answered(arguments: argparse.Namespace) -> int:
    """Run the verb; what ends it is one line and an exit code."""
    # numpy after the check of the memory and the choice of the cache
    from numpy.linalg import LinAlgError

    try:
        return _interruptible(arguments)
    except MissingLibrary as error:
        return _complain(str(error), 4)
    except InputError as error:
        return _complain(" ".join(str(error).split()), 2)
    except BlockingIOError as error:  # raised by the lock of the results folder
        return _complain(str(error), 4)
    except ModuleNotFoundError as error:
        return _complain(
            f"{error.name} is not installed, and this job needs it; run: tipdamp doctor", 4
        )
    except (OSError, ImportError) as error:
        return _complain(_of_the_machine(error), 4)
    except (RuntimeError, ArithmeticError, LinAlgError) as error:
        return _complain(f"could not be solved: {' '.join(str(error).split())}", 3)
    except MemoryError as error:
        return _complain(f"not enough memory: {error or 'an allocation failed'}{_limit()}", 4)


class _Said:
    """What a verb says, and what it would say again: again - lines; needs_bytes - of the stage that
    is estimated to need most."""

    def __init__(self) -> None:
        self.again: list[str] = []
        self.needs_bytes = 0.0

    def __call__(self, now: str, again: str | None = None) -> None:
        print(now, flush=True)
        self.again.append(now if again is None else again)


def _asked(arguments: argparse.Namespace) -> receipts.Asked | None:
    """What a receipt answers: a verb that makes results, where they are not asked for anew."""
    given = vars(arguments)
    study, jobs = given.get("study"), given.get("jobs")
    if isinstance(study, list):
        study = study[0] if len(study) == 1 else None
    if arguments.verb not in (*STAGES, "run") or given["force"] or given.get("full") or not study:
        return None
    allowed = (arguments.allow_outside, given.get("allow_code"))
    return receipts.Asked(arguments.verb, study, arguments.out, (*allowed, jobs))


def _kept(arguments: argparse.Namespace) -> receipts.Receipt | None:
    asked = _asked(arguments)
    return receipts.find(asked) if asked and ranks.count() == 1 else None


def _interruptible(arguments: argparse.Namespace) -> int:
    """Run the verb. An interrupt in the midst of compiled code comes as an error of that code: it
    is made one again."""
    try:
        with _code_as_allowed(arguments):
            return arguments.run(arguments)
    except Exception as error:
        behind: BaseException | None = error
        while behind is not None and not isinstance(behind, KeyboardInterrupt):
            behind = behind.__cause__ or behind.__context__
        if behind is not None:
            raise behind from None
        raise


def _code_as_allowed(arguments: argparse.Namespace) -> AbstractContextManager:
    """Files of laws run only where the command line says so."""
    if not vars(arguments).get("allow_code"):
        return nullcontext()
    from tipdamp.study.own_law import code_allowed

    return code_allowed()


def _of_the_machine(error: OSError | ImportError) -> str:
    """What the operating system refused; a library that finds no room for itself says so in other
    words."""
    if (
        isinstance(error, ImportError)
        or "shared object" in str(error)
        or error.errno == errno.ENOMEM
    ):
        room = "failed to map" in str(error) or "allocate memory" in str(error) or _limit()
        return (
            f"not enough memory: {error}{_limit()}"
            if room
            else f"a library could not be loaded: {error}; run: tipdamp doctor"
        )
    return ": ".join(shown(part, 400) for part in (error.filename, error.strerror or error) if part)


def _limit() -> str:
    """The limit of the address space, where there is one."""
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    return (
        f" (the address space is limited to {limit / 1e6:.0f} MB: ulimit -v)" if limit >= 0 else ""
    )


def _alone(arguments: argparse.Namespace) -> int:
    """Under mpirun, of a verb that is the work of one process."""
    if ranks.number():
        return 0
    return _complain(
        f"{arguments.verb} is the work of one process, and mpirun started {ranks.count()}: run it "
        "without mpirun (--jobs computes curves side by side); over ranks there is tipdamp "
        "preload --full",
        2,
    )


def _beside(arguments: argparse.Namespace) -> int:
    """Under mpirun, every process but the first: errors that come to all are said by the first."""
    from tipdamp.stages.full import share
    from tipdamp.study.study import load_study

    with suppress(InputError):
        share(load_study(arguments.study))
    return 0


def _complain(text: str, code: int) -> int:
    print(f"tipdamp: {shown(text, LONGEST_LINE)}", file=sys.stderr)
    return code


class _OneLine(logging.Formatter):
    """Names from files may hold line breaks and escapes of terminals."""

    def format(self, record: logging.LogRecord) -> str:
        return shown(super().format(record), LONGEST_LINE)


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"'{text}' is no number above 0")
    return value


Option = tuple[str, dict[str, Any]]  # of argparse: its name, how it is read


def _value(name: str, text: str, **how: Any) -> Option:
    return name, {"help": text, **how}


def _flag(name: str, text: str, **how: Any) -> Option:
    return _value(name, text, action="store_true", **how)


def _number(name: str, text: str, kind: Callable = int) -> Option:
    return _value(name, text, type=kind, metavar="N")


STUDY = _value("study", "study file (.toml)")
STUDY_OR_MESHES = _value(
    "study",
    "study file (.toml), or mesh files without a study, for which one is proposed",
    nargs="+",
)
QUIET = _flag("--quiet", "no progress")
CODE = _flag(
    "--allow-code", "run the file of Python that the study names as its law; read it before"
)
RESULTS = (
    _value("--out", "results folder (default: results/<study name> beside the study)"),
    _flag("--allow-outside", "let the study's key `results` lead out of its folder"),
    CODE,
)
CURVES = _number(
    "--jobs",
    "curves that are computed side by side, with one BLAS thread each (default: TIPDAMP_JOBS, or "
    "all cores); 1: in this process",
)
OF_STAGES = {  # beside the options of every stage
    "inspect": (
        _number(
            "--pull",
            "pull on the damper, for the study that meshes propose: its levels follow",
            _positive,
        ),
        _value(
            "--load-points",
            "group of the damper's nodes that share the pull, for the study that meshes propose, "
            "where its name does not tell (load, pull, cf, centrifugal)",
            metavar="NAME",
            default="",
        ),
    ),
    "preload": (
        _flag(
            "--full",
            "also by Newton's method on the unreduced bodies, for comparison; with mpirun -n N "
            "over N processes, after a preload without it",
        ),
    ),
    "respond": (CURVES,),
}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tipdamp",
        description="Friction pin dampers between turbine blade tips: "
        "preload map, detachment tuning, forced response.",
    )
    parser.add_argument("--version", action="version", version=f"tipdamp {tipdamp.__version__}")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")

    def verb(name: str, text: str, run: Callable, *options: Option, **defaults: Any) -> None:
        added = verbs.add_parser(name, help=text, description=text)
        added.set_defaults(run=run, **defaults)
        for option, how in options:
            added.add_argument(option, **how)

    of_all = *RESULTS, _flag("--force", "run even when nothing has changed"), QUIET
    for name, text in STAGES.items():
        of_one = OF_STAGES.get(name, ())
        if name == "inspect":
            verb(name, text, _inspect, STUDY_OR_MESHES, *of_all, *of_one)
        else:
            verb(name, text, _one_stage, STUDY, *of_all, *of_one)
    all_stages = "all stages, from the meshes to the report"
    verb("run", all_stages, _all_stages, STUDY, *of_all, CURVES)
    verb(
        "sweep",
        "the cases of [sweep] in the study: what is not there yet, side by side, into one store",
        _sweep,
        STUDY,
        *RESULTS,
        QUIET,
        _number(
            "--jobs",
            "cases that are computed side by side (default: TIPDAMP_JOBS, or all cores); 1: in "
            "this process",
        ),
        _value(
            "--scheduler",
            "on a cluster of dask.distributed, such as tcp://host:8786; local: on one of --jobs "
            "processes on this machine",
            metavar="ADDRESS",
        ),
        _flag("--dry-run", "the estimate alone: cases, time, disk and memory"),
        _flag("--retry", "try what failed before again"),
        _flag("--status", "how far it is, also while it runs, and what failed"),
    )
    verb(
        "export",
        "the reduced model of a study (reduced before), or its responses, for other codes",
        _export,
        STUDY,
        *RESULTS,
        _value(
            "--format",
            "npz, mat, mtx (Matrix Market), op4 or pch (Nastran); unv: the computed responses as "
            "universal file",
            default="mtx",
        ),
    )
    verb(
        "compare",
        "studies that were run, side by side on one page: which damper is best, at which pull",
        _compare,
        _value(
            "studies",
            "study files (.toml); those that [compare] of one names are added",
            nargs="+",
            metavar="study",
        ),
        _value(
            "--out",
            "folder of the page (default: results/comparison beside the first study, of one study "
            "alone results/comparison_NAME)",
        ),
        _flag(
            "--run",
            "first run what is missing of the studies, or of their sweeps",
            dest="run_missing",
        ),
        _number("--jobs", "with --run: curves or cases side by side"),
        QUIET,
        _flag("--allow-outside", "let the key `results` of a study lead out of its folder"),
        CODE,
        force=False,  # its stages run as those of `run`
    )
    verb("doctor", "what is missing or wrong on this machine, with the repair", _doctor)
    verb(
        "keys",
        "every key of a study file: unit, default, range and meaning",
        _keys,
        _flag("--json-schema", "as JSON schema, for editors that complete a study"),
    )
    verb(
        "explain",
        "a key of a study file: unit, default, range, meaning",
        _explain,
        _value("key", "such as kn or contact.left.kn; a section for all its keys"),
    )
    verb(
        "init",
        "a first study that runs, with its files, commented",
        _init,
        _value("folder", "where it is written (default: here)", nargs="?", default="."),
    )
    verb(
        "completion",
        'what bash and zsh complete: eval "$(tipdamp completion)" in ~/.bashrc or ~/.zshrc',
        _completion,
        verbs=verbs.choices,
    )
    return parser


def _keys(arguments: argparse.Namespace) -> int:
    import json

    from tipdamp.study.documentation import json_schema, reference

    print(
        json.dumps(json_schema(), indent=1) + "\n" if arguments.json_schema else reference(), end=""
    )
    return 0


def _explain(arguments: argparse.Namespace) -> int:
    from tipdamp.study.documentation import explain

    print(explain(arguments.key), end="")
    return 0


def _completion(arguments: argparse.Namespace) -> int:
    from tipdamp.study.completion import script
    from tipdamp.study.documentation import key_names

    print(script(arguments.verbs, key_names()), end="")
    return 0


def _init(arguments: argparse.Namespace) -> int:
    from tipdamp.proposal.first_study import write_first_study

    study = write_first_study(Path(arguments.folder))
    print(f"{study}\nrun it: tipdamp run {study}")
    return 0


def _export(arguments: argparse.Namespace) -> int:
    from tipdamp.hbm.matrices_out import write_model
    from tipdamp.hbm.model import ReducedModel
    from tipdamp.stages.run import command
    from tipdamp.stages.universal_responses import write_responses

    study, store = _opened(arguments)
    if arguments.format == "unv":
        print(write_responses(study, store))
        return 0
    if not store.path("model.npz").is_file():
        raise InputError(
            f"{arguments.study}: nothing to export yet; run: {command('reduce', study, store)}"
        )
    for planted in store.path("export").glob("*"):
        store.path(f"export/{planted.name}")  # a link that leads out would be written through
    for path in write_model(
        ReducedModel.load(store.path("model.npz")), store.path("export"), arguments.format
    ):
        print(path)
    return 0


def _compare(arguments: argparse.Namespace) -> int:
    from tipdamp.comparison.page import is_drawn, write_comparison
    from tipdamp.comparison.read import folder_of, mark_of, read, refuse, source, studies_of
    from tipdamp.stages.run import results_folder
    from tipdamp.sweep.run import run_sweep

    studies = studies_of(arguments.studies)
    refuse(studies)
    stores = [results_folder(study, None, arguments.allow_outside) for study in studies]
    if arguments.run_missing:
        with _workers(arguments) as workers:
            for study, store in zip(studies, stores, strict=True):
                print(f"study       {study.path}", flush=True)
                if "sweep" in study:
                    run_sweep(study.path, store, workers, quiet=arguments.quiet)
                else:
                    _stages(arguments, _Said(), study, store, workers)
    sources = [source(*pair) for pair in zip(studies, stores, strict=True)]
    folder, mark = Path(arguments.out or folder_of(studies)), mark_of(sources)
    page = folder / "comparison.html"
    if is_drawn(folder, mark):
        print(f"compare: {page} is up to date")
        return 0
    if page.exists():
        print(f"compare: {page} of before is replaced")
    print(f"compare: {write_comparison(read(sources), folder, mark)}")
    return 0


def _doctor(_: argparse.Namespace) -> int:
    from tipdamp.doctor import checks, report

    found = checks()
    print(report(found))
    return 4 if any(c.status == "fail" for c in found) else 0


def _opened(
    arguments: argparse.Namespace, workers: "Workers | None" = None
) -> "tuple[Study, Store]":
    """(study, store) that the command line names; workers - prepared while the stages are
    loaded."""
    from tipdamp.study.study import load_study

    study = load_study(arguments.study)
    if workers is not None:
        workers.prepare()
    from tipdamp.stages.run import results_folder

    for key, path in study.inputs().items():
        if path.is_file() and not study.holds(path):
            logging.getLogger("tipdamp").warning(
                "%s is read from outside the study's folder: %s", key, path.resolve()
            )
    return study, results_folder(study, arguments.out, arguments.allow_outside)


def _inspect(arguments: argparse.Namespace) -> int:
    """Of a study; of meshes alone, the study that they propose."""
    paths = [Path(name) for name in arguments.study]
    if len(paths) == 1 and paths[0].suffix.lower() == ".toml":
        if arguments.pull is not None:
            raise InputError("--pull is for meshes without a study; this one has its own pull")
        if arguments.load_points:
            raise InputError(
                "--load-points is for meshes without a study; this one has its own load_points"
            )
        arguments.study = arguments.study[0]
        return _one_stage(arguments)
    from tipdamp.proposal.write import write_proposal

    print(write_proposal(paths, arguments.pull, arguments.load_points, arguments.quiet))
    return 0


def _one_stage(arguments: argparse.Namespace) -> int:
    asked, said = _asked(arguments), _Said()
    before = receipts.begin(asked)
    with _workers(arguments) as workers:
        study, store = _opened(arguments, workers if arguments.verb in PARALLEL else None)
        if arguments.verb == "respond":
            _compile_beside(workers, study, store)
        if ranks.count() == 1:
            _run(arguments, said, arguments.verb, study, store, workers)
        if vars(arguments).get("full"):
            from tipdamp.stages.full import release

            try:
                _run(arguments, said, "full", study, store, workers)
            finally:
                release()
    partial = _partial(store) if arguments.verb == "respond" else ""
    return _ended(study, asked, before, said, partial)


def _all_stages(arguments: argparse.Namespace) -> int:
    asked, said = _asked(arguments), _Said()
    before = receipts.begin(asked)
    with _workers(arguments) as workers:
        study, store = _opened(arguments, workers)
        _refuse_code(study)
        began = time.perf_counter()
        _stages(arguments, said, study, store, workers)
    report = f"report: {store.path('report.html')}"
    said(f"{report}  ({time.perf_counter() - began:.1f} s)", report)
    return _ended(study, asked, before, said, _partial(store))


def _refuse_code(study: "Study") -> None:
    """Before anything is computed, where the law is a file that may not run."""
    if "respond" in study:
        try:
            study.respond.law.refuse_code()
        except InputError as error:
            raise InputError(f"{study.path}: [respond] law: {error}") from None


def _ended(
    study: "Study",
    asked: receipts.Asked | None,
    before: tuple[Path, str] | None,
    said: _Said,
    partial: str,
) -> int:
    """Exit code of a verb; it leaves a receipt, except where it warned of files from outside."""
    code = 3 if partial else 0
    if all(study.holds(path) for path in study.inputs().values()):
        receipts.keep(asked, before, receipts.Receipt(said.again, partial, code, said.needs_bytes))
    return _complain(partial, code) if partial else 0


def _stages(
    arguments: argparse.Namespace, said: _Said, study: "Study", store: "Store", workers: "Workers"
) -> None:
    from tipdamp.stages import run

    with store.lock():
        _compile_beside(workers, study, store)
        for name in STAGES:
            if missing := run.STAGES[name].lacks(study):
                said(f"{name:8s}    nothing to do: the study has no {', '.join(missing)}")
            else:
                _run(arguments, said, name, study, store, workers, locked=True)


def _sweep(arguments: argparse.Namespace) -> int:
    from tipdamp.comparison.swept import lacks_own_case
    from tipdamp.stages.run import command
    from tipdamp.sweep.estimate import sweep_estimate
    from tipdamp.sweep.run import folder_of, planned, run_sweep
    from tipdamp.sweep.summary import status

    study, store = _opened(arguments)

    def tell(found: "SweepEstimate") -> None:
        print(f"estimate    {found.text}", flush=True)
        for warning in found.warnings:
            print(f"warning: {warning}", flush=True)
        if lacking := lacks_own_case(study):
            print(f"compare     will refuse this sweep as it is: {lacking}", flush=True)

    if arguments.dry_run:
        plan, content = planned(study.path, quiet=arguments.quiet)
        tell(sweep_estimate(plan, content, study.path, store, _workers(arguments).jobs))
        return 0
    files = []
    if not arguments.status:
        _refuse_code(study)
        with _sweepers(arguments, folder_of(store)) as workers:
            options = {"quiet": arguments.quiet, "retry": arguments.retry, "tell": tell}
            files = run_sweep(study.path, store, workers, **options)
    text, whole = status(folder_of(store), command("sweep", study, store))
    print("\n".join([text, *map(str, files)]))
    return 0 if whole else 3


def _sweepers(arguments: argparse.Namespace, folder: Path) -> AbstractContextManager:
    """The processes for a sweep: here, or on a cluster."""
    if arguments.scheduler is None:
        return _workers(arguments)
    from tipdamp.sweep.cluster import cluster

    folder.mkdir(parents=True, exist_ok=True)
    return cluster(arguments.scheduler, _workers(arguments).jobs, folder)


def _workers(arguments: argparse.Namespace) -> "Workers":
    """The processes that the command line allows."""
    from tipdamp.engine.workers import Workers, default_jobs

    jobs = vars(arguments).get("jobs")
    if jobs is not None and jobs < 1:
        raise InputError(f"--jobs {jobs}: must be 1 or more")
    return Workers(default_jobs() if jobs is None else jobs)


def _compile_beside(workers: "Workers", study: "Study", store: "Store") -> None:
    """Before the first forced response, its kernels are compiled or loaded while the work before it
    is done."""
    from tipdamp.engine.curves import compile_kernels

    responds = "respond" in study and study.respond.levels
    if workers.jobs > 1 and responds and store.record("respond") is None:
        workers.begin(compile_kernels, study.respond.law.make())


def _run(
    arguments: argparse.Namespace,
    said: _Said,
    name: str,
    study: "Study",
    store: "Store",
    workers: "Workers",
    *,
    locked: bool = False,
) -> None:
    """One stage with its line and warnings; locked: whether this process holds the folder."""
    from tipdamp.stages import run

    before = run.changed(name, study, store)
    if not arguments.quiet and (arguments.force or before or store.record(name) is None):
        _expect(name, study, store, workers.jobs)
    how = run.run_stage(
        name,
        study,
        store,
        force=arguments.force,
        quiet=arguments.quiet,
        workers=workers,
        locked=locked,
    )
    record = store.record(name)
    when = "up to date" if how == "skipped" or record is None else f"{record.seconds:.1f} s"
    line = run.stage_of(name).line(store)
    said(*(f"{name:8s} {one:>10s}  {line}" for one in (when, "up to date")))
    if before and how != "skipped":
        more = ", ..." * (len(before) > 8)
        print(f"made again: since the last run {', '.join(before[:8])}{more} changed", flush=True)
    for warning in run.stage_of(name).warnings(study, store):
        said(f"warning: {shown(warning, 4000)}")
    if name == "inspect":
        _forecast(said, study, store, workers.jobs)


def _expect(name: str, study: "Study", store: "Store", jobs: int) -> None:
    """What a stage that takes more than a minute is estimated to cost, before it begins."""
    from tipdamp.checks.forecast import SETTINGS, costs_of, estimate
    from tipdamp.results.static_results import InspectResult, TuneResult
    from tipdamp.stages.respond import acting_pairs

    with suppress(InputError):
        kept = TuneResult.load(store).kept_pairs if name == "respond" else None
        size, costs = estimate(study, InspectResult.load(store), jobs, kept)
        if name not in costs or max(costs[name].seconds, costs[name].at_most) <= SETTINGS.short:
            return
        if name == "respond":
            costs = costs_of(replace(size, acting=acting_pairs(study, store)))
        print(f"{name:8s}   estimate  {costs[name].text}", flush=True)


def _forecast(said: _Said, study: "Study", store: "Store", jobs: int) -> None:
    """What all stages are estimated to cost, and what will be slow."""
    from tipdamp.checks.forecast import advice, estimate
    from tipdamp.results.static_results import InspectResult

    size, costs = estimate(study, InspectResult.load(store), jobs)
    texts = "; ".join(f"{stage} {cost.text}" for stage, cost in costs.items())
    said(f"{'':21s}estimate: {texts}")
    for warning in advice(size, costs):
        said(f"warning: {warning}")
    said.needs_bytes = max(
        (most for c in costs.values() for most in (c.bytes, c.bytes_at_most)), default=0.0
    )


def _partial(store: "Store") -> str:
    """What is incomplete of the curves of the forced response; '' where nothing is."""
    from tipdamp.results.response_results import RespondResult
    from tipdamp.stages.respond import incomplete, solved_nothing, without_peak

    if store.record("respond") is None:
        return ""
    found = RespondResult.load(store)
    (partial, curves), peakless = incomplete(found), without_peak(found)
    if partial:
        missing = f", {peakless} of them without a peak" if peakless else ""
        missing += (
            f", {nothing} without a solved point" if (nothing := solved_nothing(found)) else ""
        )
        return f"{partial} of {curves} curves are incomplete{missing}, see the warnings"
    return ""
