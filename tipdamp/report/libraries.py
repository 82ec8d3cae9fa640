"""The libraries of the pages, which a study of matrices alone does not need."""

from importlib.util import find_spec

from tipdamp.hbm.errors import InputError


class MissingLibrary(InputError):
    """A library of the report is not installed: nothing is wrong with the study."""


def missing(*names: str) -> str:
    """The first of these libraries that is not installed, or ''."""
    return next((name for name in names if find_spec(name) is None), "")


def need(name: str) -> None:
    """MissingLibrary where a library of the report is not installed, with the extra that brings
    it."""
    if missing(name):
        raise MissingLibrary(
            f"the report needs {name}, which is not installed; get the extra 'study': "
            "pip install -e '.[study]'"
        )
