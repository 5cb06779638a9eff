"""An independent laboratory: rigs, materials and measuring chains that conceal one effect or two.

Shares no code with fmu/ or harness/: its own equations, its own integrator (motion.py), its own chain
(chain.py). `python -m tests.concealed --seed S --cases N --out DIR` draws a set of cases, with `--group` campaigns as
real as a rig (groups.py): true laws a little off, dirty measurements, little measured, strangers to the vocabulary.
"""
