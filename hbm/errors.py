"""InputError, the one exception for input that cannot be used, the tail of its messages; Doubt, the
one warning; and libraries that may be missing."""

from collections.abc import Iterable
from difflib import get_close_matches
from importlib import import_module
from types import ModuleType

EXPLAINED = "docs/warnings.md"  # the page of warnings


class InputError(ValueError):
    """Unusable input, found before any heavy work: one line with the given value and the allowed
    ones.

    >>> Contacts(kn=1e6, kt=-1e6, mu=0.5, preload=40)
    Traceback (most recent call last):
    tipdamp.hbm.errors.InputError: contact 0: kt = -1e+06, must be finite and not negative
    """


class Doubt(UserWarning):
    """A result that may not be what it looks like: the class of all warnings of this library.

    docs/warnings.md explains each of them, and what to do; the text of a warning ends with its
    name, the sentence alone is `args[0]`.

    >>> import warnings
    >>> print(Doubt("K is indefinite"))
    K is indefinite (docs/warnings.md)
    >>> warnings.simplefilter("error", Doubt)  # a script that stops where there is a doubt
    >>> warnings.simplefilter("default", Doubt)
    """

    def __str__(self) -> str:
        return f"{super().__str__()} ({EXPLAINED})"


def shown(name: object, most: int = 80) -> str:
    """A name from a file as it may stand in a message: control characters escaped, cut at so many
    characters."""
    text = "".join(c if c.isprintable() else repr(c)[1:-1] for c in str(name))
    return text if len(text) <= most else f"{text[: most - 3]}..."


def nearest(name: str, allowed: Iterable) -> str:
    """'did you mean ...?' and the list of valid names, as the tail of an error line."""
    allowed = [shown(a) for a in allowed]
    if not allowed:
        return "there are none to choose from"
    close = get_close_matches(shown(name), allowed, n=1, cutoff=0.5)
    hint = f"did you mean '{close[0]}'? " if close else ""
    return f"{hint}valid: {', '.join(allowed)}"


def library(name: str, purpose: str) -> ModuleType:
    """A module that a picture or a table asks for, and nothing else; InputError, with the command
    that brings it, where it is not installed."""
    try:
        return import_module(name)
    except ImportError:
        top = name.split(".")[0]
        raise InputError(
            f"{purpose} needs {top}, which is not installed: pip install {top}"
        ) from None
