"""From a study to its state at rest: model, load cases, friction at rest, stress."""
