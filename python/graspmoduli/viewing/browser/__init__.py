"""Objects, grasps and shapes in a browser: ``graspmoduli view``. Needs the extra ``view`` (viser).

Every browser has a page of its own: what one does is not seen in another. Coordinates in the scene
are those of the fitted surface, divided by its length scale.
"""

from importlib.util import find_spec

from ..._core import GraspModuliError

if find_spec("viser") is None:
    raise GraspModuliError("view needs viser: pip install 'graspmoduli[view]'")
