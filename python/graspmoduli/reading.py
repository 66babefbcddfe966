"""Objects from files, by the name of before; they live in :mod:`graspmoduli.objects`."""

from .objects.reading import Object as Object
from .objects.reading import read as read
