"""What can be concealed: every mechanism of the vocabulary in several forms, and things outside it."""
from . import forms_chain, forms_contact, forms_motion, forms_unknown  # noqa: F401  (they register their forms)
from .forms import FORMS, ORIGIN, STRANGE, allowed  # noqa: F401
