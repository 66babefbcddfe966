"""Fits of real objects, by the name of before; they live in :mod:`graspmoduli.objects`."""

from .objects.fitting import Fit as Fit
from .objects.fitting import ObjectGrasp as ObjectGrasp
from .objects.fitting import Residual as Residual
from .objects.fitting import fit as fit
