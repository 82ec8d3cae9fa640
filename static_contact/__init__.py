"""The damper at rest: contact stiffness, pairs of nodes, preload, detachment."""
