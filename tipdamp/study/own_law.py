"""A contact law of the user's own in a file beside the study, 'my_law.py:Dahl'.

The file is code: it runs only where that is allowed, after its conformance run, and as it was when
the study was read. What is made from it carries its content along, so that another content is
another law.
"""

import copyreg
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache, partial
from hashlib import sha256
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from tipdamp.hbm.errors import InputError, nearest, shown
from tipdamp.hbm.laws import ContactLaw, Contacts, PlainForce
from tipdamp.hbm.testing import check_force, check_law, contacts_of_size
from tipdamp.study.values import check_parameters

FLAG = "--allow-code"
ALLOWED: ContextVar[bool] = ContextVar("ALLOWED", default=False)
SIZES: list[dict[str, Any]] = [  # a machine's contacts at 1 kHz, by m of their motion; or all of 1
    *(
        {"contacts": contacts_of_size(1e6, u), "amplitude": u, "omega": 2e3 * np.pi}
        for u in (1e-5, 1e-6, 1e-4)
    ),
    {},
]


@contextmanager
def code_allowed(allowed: bool = True) -> Iterator[None]:
    """Within it files of laws that studies name may run.

    >>> with code_allowed():  # a law by file is a program: read it first
    ...     law = load_study("study.toml").respond.law  # doctest: +SKIP
    """
    before = ALLOWED.set(allowed)
    try:
        yield
    finally:
        ALLOWED.reset(before)


def content_of(path: Path) -> str:
    """Fingerprint of a file; InputError where there is none."""
    if not path.is_file():
        raise InputError(f"file not found: {path}")
    return sha256(path.read_bytes()).hexdigest()


def refuse_code(path: Path) -> None:
    """InputError where the file may not run."""
    if not ALLOWED.get():
        raise InputError(
            f"the law is a file of Python, {path}, which runs as your own programs do: read it, "
            f"then allow it with {FLAG}"
        )


def own_law(path: Path, content: str, name: str, parameters: dict[str, float]) -> ContactLaw:
    """The law `name` of a file whose fingerprint is `content`.

    Raises InputError where the file may not run or does not, where it has no such law, has changed
    since or breaks the contract of a law, and where the parameters are not those of the law.
    """
    refuse_code(path)
    law = _law_class(path, content, name)
    check_parameters(law, parameters)
    made = law(**parameters)
    made.check(Contacts(*np.array([[1.0], [1.0], [0.5], [1.0]])))
    _keep_contract(path, content, name, tuple(sorted(parameters.items())))
    return made


def _law_class(path: Path, content: str, name: str) -> type[ContactLaw]:
    laws = _laws(_module(path, content))
    if name not in laws:
        raise InputError(f"{path} has no law '{shown(name)}'; {nearest(name, list(laws))}")
    return laws[name]


def _laws(module: ModuleType) -> dict[str, type[ContactLaw]]:
    """Those that the module defines."""
    return {
        name: one
        for name, one in vars(module).items()
        if isinstance(one, type)
        and issubclass(one, ContactLaw)
        and one.__module__ == module.__name__
    }


@cache
def _module(path: Path, content: str) -> ModuleType:
    """The file, run; its laws travel to other processes by the file."""
    code = path.read_bytes()
    if sha256(code).hexdigest() != content:
        raise InputError(f"{path} has changed since the study was read; run again")
    module = ModuleType(f"law_{content}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module  # where dataclasses look for it
    try:
        exec(compile(code, str(path), "exec"), vars(module))
    except (Exception, SystemExit) as error:
        del sys.modules[module.__name__]
        said = " ".join(str(error).split())
        raise InputError(f"{path} does not run: {type(error).__name__}: {said}") from None
    for name, law in _laws(module).items():
        copyreg.pickle(law, partial(_parts, path, content, name))  # type: ignore[arg-type]
    return module


def _parts(path: Path, content: str, name: str, law: ContactLaw) -> tuple:
    return _again, (path, content, name, vars(law))


def _again(path: Path, content: str, name: str, values: dict[str, Any]) -> ContactLaw:
    """A law in another process: the one that sent it was allowed to run the file."""
    law = object.__new__(_law_class(path, content, name))
    vars(law).update(values)
    return law


@cache
def _keep_contract(
    path: Path, content: str, name: str, parameters: tuple[tuple[str, float], ...]
) -> None:
    """The conformance run with the parameters of the study; InputError with the first point in
    which the law breaks its contract.

    Each motion is too large, too small or too steep for some parameter: one of SIZES at which the
    contract is kept is enough.
    """
    law = _law_class(path, content, name)
    check = check_force if issubclass(law, PlainForce) else check_law
    given = "".join(f", {key} = {value:g}" for key, value in parameters)
    refused = []
    for size in SIZES:
        try:
            with np.errstate(all="ignore"):
                return check(law(**dict(parameters)), **size)
        except AssertionError as error:
            refused.append(f"does not keep the contract of a law{given}: {error}")
        except Exception as error:
            kind = "" if isinstance(error, InputError) else f"{type(error).__name__} in {name}: "
            refused.append(f"conformance run{given}: {kind}{error}")
    raise InputError(f"{path}: {' '.join(refused[0].split())}")
