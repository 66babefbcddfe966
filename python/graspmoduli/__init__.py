"""Exact grasp quality, and grasps on families of shapes.

=====================  ======================================================================
grasp quality          :func:`quality`, :func:`quality_gradient`, :func:`circular_quality`
many grasps            :func:`quality_at_least`, :func:`largest_quality`, :func:`smallest_quality`
given wrenches         :func:`quality_of_wrenches`; soft fingers: :func:`pad_torsion`
other measures         :func:`measures`: largest force and torque, singular values, min-weight
one grasp              :class:`WrenchSpace`: status, weakest direction, forces against a wrench;
                       :func:`contact_frames`
surfaces               :class:`Surface`, :func:`combine`, :func:`project`, :mod:`shapes`
grasps                 :class:`Grasp`, :func:`place`, :func:`grasp_gradient`
the moduli space       :func:`surface_distance`, :func:`placed_distance`, :func:`distance`,
                       :func:`interpolate`, :func:`quality_along`, :func:`transfer`,
                       :func:`sample_combinations`, :func:`closest_combination`
random configurations  :func:`sample_configurations`, :func:`sample_nearby`
guarantees             :func:`certified_radius`, :func:`certify_transfer`,
                       :func:`transfer_bound`, :func:`epsilon`
finding grasps         :func:`sample_points`, :func:`best_grasps`, :func:`synthesize`,
                       :func:`plane_grasp`
real objects           :func:`fit`, :func:`fit_parts`, :func:`contact_map`
where fingers may go   :class:`Constraints`, :func:`contact_regions`
errors                 :class:`GraspModuliError`, :class:`NoGraspLeftError`,
                       :class:`MissingExtraError`
=====================  ======================================================================

The mathematics is that of F. T. Pokorny, K. Hang, D. Kragic, *Grasp Moduli Spaces*, RSS 2013.
Arrays are float64 with leading batch shapes, angles are in radians, lengths in the unit of the
object, normals point into it.
"""

from . import shapes as shapes
from ._arrays import NoGraspLeftError as NoGraspLeftError
from ._batches import GraspLike as GraspLike
from ._batches import contact_frames as contact_frames
from ._core import GraspModuliError as GraspModuliError
from ._extras import MissingExtraError as MissingExtraError
from .configurations import Configurations as Configurations
from .configurations import sample_configurations as sample_configurations
from .configurations import sample_nearby as sample_nearby
from .constraints import Constraints as Constraints
from .epsilon import Epsilon as Epsilon
from .epsilon import epsilon as epsilon
from .grasps import Grasp as Grasp
from .grasps import GraspGradient as GraspGradient
from .grasps import PlacedGrasp as PlacedGrasp
from .grasps import RankedGrasp as RankedGrasp
from .grasps import grasp_gradient as grasp_gradient
from .grasps import place as place
from .guarantees import Certificate as Certificate
from .guarantees import certified_radius as certified_radius
from .guarantees import certify_transfer as certify_transfer
from .guarantees import transfer_bound as transfer_bound
from .measures import Measures as Measures
from .measures import measures as measures
from .moduli import SurfaceDistance as SurfaceDistance
from .moduli import distance as distance
from .moduli import interpolate as interpolate
from .moduli import placed_distance as placed_distance
from .moduli import sample_combinations as sample_combinations
from .moduli import sample_weights as sample_weights
from .moduli import surface_distance as surface_distance
from .objects.contact_regions import ContactRegion as ContactRegion
from .objects.contact_regions import ContactRegions as ContactRegions
from .objects.contact_regions import contact_regions as contact_regions
from .objects.fitting import Fit as Fit
from .objects.fitting import ObjectGrasp as ObjectGrasp
from .objects.fitting import Residual as Residual
from .objects.fitting import fit as fit
from .objects.parts import Parts as Parts
from .objects.parts import fit_parts as fit_parts
from .objects.touching import ContactCheck as ContactCheck
from .objects.touching import ContactMap as ContactMap
from .objects.touching import contact_map as contact_map
from .quality import Bounds as Bounds
from .quality import Extreme as Extreme
from .quality import QualityGradient as QualityGradient
from .quality import circular_quality as circular_quality
from .quality import largest_quality as largest_quality
from .quality import pad_torsion as pad_torsion
from .quality import quality as quality
from .quality import quality_at_least as quality_at_least
from .quality import quality_gradient as quality_gradient
from .quality import quality_of_wrenches as quality_of_wrenches
from .quality import smallest_quality as smallest_quality
from .sampling import sample_points as sample_points
from .surfaces import Surface as Surface
from .surfaces import closest_combination as closest_combination
from .surfaces import combine as combine
from .surfaces import project as project
from .synthesis import best_grasps as best_grasps
from .synthesis import plane_grasp as plane_grasp
from .synthesis import synthesize as synthesize
from .tasks import gravity as gravity
from .tasks import task_gradient as task_gradient
from .tasks import task_quality as task_quality
from .transfers import QualityAlong as QualityAlong
from .transfers import Transfer as Transfer
from .transfers import quality_along as quality_along
from .transfers import transfer as transfer
from .wrench_space import HalfSpaces as HalfSpaces
from .wrench_space import Resistance as Resistance
from .wrench_space import WrenchSpace as WrenchSpace
