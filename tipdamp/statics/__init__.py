"""From a study to its state at rest: inputs of the model, cases of load, friction at rest,
stress."""
