"""Bad inputs and faults: the catalogue of tests/reference/robustness/bad-inputs.md, row by row, and
what is like it.

python -m tests.robustness [--out docs/reliability.md]     every row, and the page that says what
was answered"""
