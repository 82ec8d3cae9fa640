"""D. Solver trouble."""


