//! Is the origin in the interior of a convex hull in R⁶ that is known only by its farthest points?
//!
//! Let m be a point in the interior of the hull, relative to its dimension. If the origin is in
//! the interior, the ray from it through d = −m leaves the hull through a facet: d = Σ λ_k w_k
//! with λ ≥ 0 and six points w_k of the hull, and these and m are a simplex about the origin. If
//! it is not, the hull lies behind a plane through the origin, and d before it.
//!
//! Both are answers of the simplex method to: maximise ⟨x, d⟩ with ⟨x, w⟩ ≤ 1 for all points w of
//! the hull. Its columns are the points w, generated when they are needed by asking for the
//! farthest point in the direction x. It starts from six artificial columns ± e_k that cost more
//! than any real one, so that x has two parts: that of the artificial costs counts first, and
//! when no point of the hull lies beyond it, it is the normal of the separating plane.

use super::r6::{Twist, add, dot, unit};
use super::support::{Levels, Support};

/// A hull that reaches no farther than this beyond a plane through the origin, in units of forces
/// and of torques about the contacts' centroid over the longest distance from it, does not contain
/// the origin in its interior: it is on the boundary. All that this library says of force closure
/// rests on this number.
pub(super) const BOUNDARY: f64 = 1e-12;
/// Where a hull reaches farther than [`BOUNDARY`], but no farther than this, rounding may keep all
/// methods from an answer. Then, and only then, it counts as on the boundary, too.
pub(super) const UNCLEAR_BOUNDARY: f64 = 1e-8;
/// Steps before the method counts as failed; it needs about a dozen.
const MOST_STEPS: usize = 500;
/// An entry of a column, relative to the largest, that is too small to divide by.
const PIVOT: f64 = 1e-11;

/// Coordinates in which a hull is looked at.
pub(super) trait Coordinates {
    /// A polar vertex in the hull's own coordinates, in which lengths are measured.
    fn own(&self, x: &Twist) -> Twist;
    /// A point of the hull in these coordinates.
    fn point(&self, point: &Twist) -> Twist;
}

/// The hull's own.
pub(super) struct Own;

impl Coordinates for Own {
    #[inline(always)]
    fn own(&self, x: &Twist) -> Twist {
        *x
    }

    #[inline(always)]
    fn point(&self, point: &Twist) -> Twist {
        *point
    }
}

impl Coordinates for Basis {
    fn own(&self, x: &Twist) -> Twist {
        self.of_axes(x)
    }

    fn point(&self, point: &Twist) -> Twist {
        self.to_axes(point)
    }
}

/// Where the origin is.
pub(super) enum Position {
    /// In the interior of the hull: of the simplex of six of its points and the one inside.
    Surrounded(Box<Basis>),
    /// Not in the interior of the hull: a unit x with ⟨x, w⟩ ≤ [`BOUNDARY`] for all its points.
    Separated(Twist),
    /// Rounding kept the method from an answer; in the coordinates of this basis, in which the hull
    /// is less flat, it may find one.
    Unclear(Box<Basis>),
}

/// Seven points about the origin, and the facets of their simplex by their polar vertices: the x
/// with ⟨x, p⟩ = level of p for all points p but that of the same index.
#[derive(Debug, Clone)]
pub(super) struct Simplex {
    /// The last one is the point in the interior of the hull.
    pub points: [Twist; 7],
    pub facets: [Twist; 7],
}

/// Looks at the hull in some coordinates; lengths are those of its own.
pub(super) fn surround(
    support: &impl Support,
    levels: Levels,
    coordinates: &impl Coordinates,
) -> Position {
    let inside = coordinates.point(&support.inside(levels));
    let mut basis = Basis::artificial(&inside.map(|c| -c));
    let mut flattest = (f64::INFINITY, [0.0; 6]);
    for _ in 0..MOST_STEPS {
        let artificial = basis.artificial > 0;
        let x = basis.polar(|column| match (artificial, column.level) {
            (true, level) => f64::from(level.is_none()),
            (false, level) => level.unwrap_or_default(),
        });
        let own = coordinates.own(&x);
        let (point, key) = support.farthest(&own);
        let height = dot(&own, &point);
        let level = levels.of(key);
        let (direction, length) = unit(&own);
        if height / length < flattest.0 {
            flattest = (height / length, direction);
        }
        if artificial {
            if height <= BOUNDARY * length {
                return Position::Separated(direction);
            }
        } else if height <= level * (1.0 + 1e-14 * dot(&x, &x).sqrt()) {
            basis.facet = x;
            if basis.weights.iter().all(|&weight| weight > 0.0) {
                return Position::Surrounded(Box::new(basis));
            }
            break;
        }
        if basis.enter(coordinates.point(&point), level).is_none() {
            break;
        }
    }
    if flattest.0 <= UNCLEAR_BOUNDARY {
        return Position::Separated(flattest.1);
    }
    Position::Unclear(Box::new(basis))
}

#[derive(Debug, Clone, Copy)]
struct Column {
    point: Twist,
    /// What ⟨x, point⟩ must not exceed; `None` if the column is artificial.
    level: Option<f64>,
}

/// Six columns, the inverse of their matrix, and the weights λ ≥ 0 with Σ λ_k w_k = d.
#[derive(Debug, Clone)]
pub(super) struct Basis {
    columns: [Column; 6],
    inverse: [Twist; 6],
    weights: [f64; 6],
    artificial: usize,
    /// The x with ⟨x, w_k⟩ = level of w_k, at the end.
    facet: Twist,
}

impl Basis {
    fn artificial(d: &Twist) -> Self {
        let signs = d.map(|c| 1.0_f64.copysign(c));
        let axis = |k: usize| -> Twist {
            let mut point = [0.0; 6];
            point[k] = signs[k];
            point
        };
        Self {
            columns: std::array::from_fn(|k| Column {
                point: axis(k),
                level: None,
            }),
            inverse: std::array::from_fn(axis),
            weights: d.map(f64::abs),
            artificial: 6,
            facet: [0.0; 6],
        }
    }

    /// The x with ⟨x, w_k⟩ = cost of column k.
    fn polar(&self, cost: impl Fn(&Column) -> f64) -> Twist {
        let mut x = [0.0; 6];
        for (column, row) in self.columns.iter().zip(&self.inverse) {
            x = add(&x, cost(column), row);
        }
        x
    }

    /// Exchanges a column for a point of the hull, so that the weights stay positive.
    fn enter(&mut self, point: Twist, level: f64) -> Option<()> {
        let entries = self.inverse.map(|row| dot(&row, &point));
        let largest = entries.iter().fold(0.0_f64, |a, c| a.max(c.abs()));
        let mut leaving = None;
        let mut least = f64::INFINITY;
        for k in 0..6 {
            if entries[k] <= PIVOT * largest {
                continue;
            }
            let ratio = self.weights[k].max(0.0) / entries[k];
            if ratio < least {
                (least, leaving) = (ratio, Some(k));
            }
        }
        let leaving = leaving?;
        let head = self.inverse[leaving].map(|c| c / entries[leaving]);
        for k in 0..6 {
            if k == leaving {
                self.inverse[k] = head;
                self.weights[k] = least;
            } else {
                self.inverse[k] = add(&self.inverse[k], -entries[k], &head);
                self.weights[k] -= entries[k] * least;
            }
        }
        self.artificial -= usize::from(self.columns[leaving].level.is_none());
        self.columns[leaving] = Column {
            point,
            level: Some(level),
        };
        Some(())
    }

    /// The simplex of the columns and the point inside, −d.
    pub fn simplex(&self) -> Simplex {
        let points = self.columns.map(|column| column.point);
        let mut inside = [0.0; 6];
        for (point, weight) in points.iter().zip(self.weights) {
            inside = add(&inside, -weight, point);
        }
        self.about(points, inside, self.facet, self.inverse)
    }

    /// The same simplex in coordinates in which the columns are the axes, w ↦ W⁻¹w: there the
    /// hull is about as long in every direction, however flat it is.
    pub fn simplex_of_axes(&self) -> Simplex {
        let axes = std::array::from_fn(|k| std::array::from_fn(|i| f64::from(i == k)));
        let levels = self.columns.map(|column| column.level.unwrap_or(1.0));
        self.about(axes, self.weights.map(|weight| -weight), levels, axes)
    }

    /// A facet through the point inside turns about the ridge without column k: along row k of the
    /// inverse, in which the point inside lies −λ_k deep.
    fn about(
        &self,
        columns: [Twist; 6],
        inside: Twist,
        facet: Twist,
        inverse: [Twist; 6],
    ) -> Simplex {
        let gap = 1.0 - dot(&facet, &inside);
        let (mut points, mut facets) = ([inside; 7], [facet; 7]);
        for k in 0..6 {
            points[k] = columns[k];
            facets[k] = add(&facet, -gap / self.weights[k], &inverse[k]);
        }
        Simplex { points, facets }
    }

    /// A point of the hull in the coordinates of [`Basis::simplex_of_axes`].
    #[inline]
    pub fn to_axes(&self, point: &Twist) -> Twist {
        self.inverse.map(|row| dot(&row, point))
    }

    /// A polar vertex in those coordinates, in the hull's own.
    #[inline]
    pub fn of_axes(&self, x: &Twist) -> Twist {
        let mut own = [0.0; 6];
        for (row, share) in self.inverse.iter().zip(x) {
            own = add(&own, *share, row);
        }
        own
    }
}
