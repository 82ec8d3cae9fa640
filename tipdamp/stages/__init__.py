"""What each stage does: from the study and the files of the stages before it to files of its own.

Every stage is a function of the form job(study, store, tick) in the file of its name (inspect in reduce.py): what it
found is in its files, which the table in `stages.py` names; it returns the names of further files whose number depends
on the study. From `preload` on only reduced matrices and contact tables are used.
"""
