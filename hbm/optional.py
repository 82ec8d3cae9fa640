"""Libraries that a picture or a table asks for, and nothing else: the kernel runs without them."""

from importlib import import_module
from types import ModuleType

from tipdamp.hbm.errors import InputError


def library(name: str, purpose: str) -> ModuleType:
    """The module; InputError, with the command that brings it, where it is not installed."""
    try:
        return import_module(name)
    except ImportError:
        top = name.split(".")[0]
        raise InputError(
            f"{purpose} needs {top}, which is not installed: pip install {top}"
        ) from None
