"""The damper at rest: contact stiffness, pairs of nodes, preload, detachment."""

if __name__ != "tipdamp.static_contact":  # a second copy of its classes would be unlike the first
    raise ImportError(f"{__name__} is a part of tipdamp: import tipdamp.static_contact")
