"""What physics does a simulation of impacts leave out, how sure is that, and an FMU that holds it.

>>> import touchdown_impact as td
>>> found = td.diagnose("my_drops")
>>> print(found)
>>> found.parameters
>>> found.fmu("HysteresisContact.fmu")

Everything is in SI. What a function cannot do it raises as `TouchdownError`, in the words of the command `touchdown`.
"""

from ._campaign import Campaign, Recording, import_
from ._diagnosis import Cause, Diagnosis, Missing, diagnose
from ._fit import Fit, fit
from ._impact import Impact, impact
from ._native import VERSION as __version__
from ._native import TouchdownError
from ._pack import Packed, pack
from ._run import Run, run
from ._task import Fmus, Progress, TouchdownWarning
from ._values import Quantity

__all__ = [
    "Campaign",
    "Cause",
    "Diagnosis",
    "Fit",
    "Fmus",
    "Impact",
    "Missing",
    "Packed",
    "Progress",
    "Quantity",
    "Recording",
    "Run",
    "TouchdownError",
    "TouchdownWarning",
    "__version__",
    "diagnose",
    "fit",
    "impact",
    "import_",
    "pack",
    "run",
]
