"""Pictures of surfaces, grasps and real objects; they are drawn in :mod:`graspmoduli.viewing`."""

from .viewing.mesh_maps import plot_contact_map as plot_contact_map
from .viewing.mesh_maps import plot_contact_regions as plot_contact_regions
from .viewing.mesh_maps import plot_parts as plot_parts
from .viewing.plotting import plot_grasps as plot_grasps
from .viewing.plotting import plot_path as plot_path
from .viewing.plotting import plot_quality as plot_quality
from .viewing.plotting import plot_row as plot_row
from .viewing.plotting import plot_rows as plot_rows
from .viewing.plotting import plot_simplex as plot_simplex
from .viewing.plotting import plot_surface as plot_surface
