"""The one exception that says: what you passed in cannot be used, and this is what would be."""

from difflib import get_close_matches


class InputError(ValueError):
    """Raised at the door, before any heavy work, in one line: what came, and what is allowed."""


def nearest(name: str, allowed) -> str:
    """'did you mean ...?' and the list of valid names, as the tail of an error line."""
    allowed = [str(a) for a in allowed]
    if not allowed:
        return "there are none to choose from"
    close = get_close_matches(str(name), allowed, n=1, cutoff=0.5)
    hint = f"did you mean '{close[0]}'? " if close else ""
    return f"{hint}valid: {', '.join(allowed)}"
