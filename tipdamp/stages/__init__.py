"""The stages of a run, one file each: what it reads of the study, its work, its line and its
warnings.

From `preload` on only reduced matrices and contact tables are used. A new stage is a file and a
line of `STAGES` in `tipdamp.results`.
"""
