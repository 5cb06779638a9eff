"""What can be concealed: every mechanism of the vocabulary in several forms, and things outside it."""
from . import forms_chain, forms_contact, forms_motion, forms_strange, forms_unknown  # noqa: F401  (they register their forms)
from .forms import DEPENDS, FORMS, ORIGIN, STRANGE, allowed  # noqa: F401
from .forms_strange import HALF, of_half  # noqa: F401

KNOWN = sorted({k[0] for k in FORMS if not k[0].startswith("unknown:")})                       # the vocabulary
OUTSIDE = sorted({k[0] for k in FORMS if k[0].startswith("unknown:")} - set(HALF))             # outside it, kinds long known
