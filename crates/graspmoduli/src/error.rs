//! What can be wrong with a request, as data; the message is made from it.

use std::fmt;

/// Misuse of the library. A grasp that is not force closure is *not* an error: its quality is 0.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// The friction coefficient is negative or not finite.
    Friction {
        /// What came.
        got: f64,
    },
    /// Fewer than three friction-cone edges.
    Edges {
        /// What came.
        got: usize,
    },
    /// The torsional friction coefficient is negative or not finite.
    Torsion {
        /// What came.
        got: f64,
    },
    /// A coordinate of a contact is not finite.
    Point {
        /// What came.
        got: [f64; 3],
    },
    /// A normal is not of unit length.
    Normal {
        /// How long it is.
        length: f64,
    },
    /// A surface needs at least four coefficients along its height and four around it.
    CoefficientShape {
        /// Along the height.
        rows: usize,
        /// Around the axis.
        columns: usize,
    },
    /// The heights do not satisfy bottom < top.
    Heights {
        /// The lower end.
        bottom: f64,
        /// The upper end.
        top: f64,
    },
    /// A radius or height of a surface is too large or too small to compute with.
    Length {
        /// What came.
        got: f64,
    },
    /// A spline coefficient is not positive and finite: row (height), column (angle), value.
    Coefficient {
        /// Along the height.
        row: usize,
        /// Around the axis.
        column: usize,
        /// What came.
        got: f64,
    },
    /// The coefficients do not fill the stated shape: wanted, got.
    CoefficientCount {
        /// How many there must be.
        wanted: usize,
        /// What came.
        got: usize,
    },
    /// The common refinement of two spline grids would be too large: rows, columns.
    GridTooLarge {
        /// Along the height.
        rows: usize,
        /// Around the axis.
        columns: usize,
    },
    /// A convex-cone operation with a factor that is not positive and finite.
    Weight {
        /// What came.
        got: f64,
    },
    /// The parts of a batch of grasps do not fit each other: how long each is.
    Batch {
        /// Contact points.
        points: usize,
        /// Normals.
        normals: usize,
        /// Centres of mass.
        centers: usize,
        /// Friction coefficients, 0 or as many as contact points.
        frictions: usize,
    },
    /// A slice is not as long as it must be.
    Count {
        /// Of what.
        name: &'static str,
        /// How long it must be.
        wanted: usize,
        /// How long it is.
        got: usize,
    },
    /// Rounding kept the expanding polytope from an answer.
    NotConverged {
        /// Which grasp.
        grasp: usize,
        /// Its quality is at least this,
        lower: f64,
        /// and at most this.
        upper: f64,
    },
    /// A relative error wanted that is not a positive number.
    Tolerance {
        /// What came.
        got: f64,
    },
    /// No bins to count in.
    Bins {
        /// What came.
        got: usize,
    },
    /// The caller asked to stop.
    Interrupted,
}

impl fmt::Display for Error {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Error::Friction { got } => {
                write!(
                    out,
                    "friction must be a finite number, 0 or positive, got {got}"
                )
            }
            Error::Edges { got } => write!(out, "edges must be at least 3, got {got}"),
            Error::Torsion { got } => write!(
                out,
                "torsion must be a finite number, 0 or positive, got {got}"
            ),
            Error::Point { got: [x, y, z] } => {
                write!(out, "points must be finite, got ({x}, {y}, {z})")
            }
            Error::Normal { length } => {
                write!(out, "normals must have length 1, got {length}")
            }
            Error::CoefficientShape { rows, columns } => write!(
                out,
                "coefficients must have shape (at least 4, at least 4), got ({rows}, {columns})"
            ),
            Error::Heights { bottom, top } => write!(
                out,
                "bottom must be below top, both finite, got bottom {bottom} and top {top}"
            ),
            Error::Length { got } => write!(
                out,
                "coefficients, heights and top - bottom must lie between 1e-50 and 1e50, got \
                 {got:e}: choose another unit"
            ),
            Error::Coefficient {
                row,
                column,
                got: value,
            } => write!(
                out,
                "coefficients must be positive and finite so that the radius is positive, \
                 got {value} at ({row}, {column})"
            ),
            Error::CoefficientCount { wanted, got } => {
                write!(out, "coefficients must have {wanted} entries, got {got}")
            }
            Error::GridTooLarge { rows, columns } => write!(
                out,
                "surfaces must have spline grids with a common refinement of at most 8192 \
                 intervals each way and 2 million in all, got one of {rows} by {columns}"
            ),
            Error::Weight { got } => {
                write!(out, "weights must be positive finite numbers, got {got}")
            }
            Error::Batch {
                points,
                normals,
                centers,
                frictions,
            } => write!(
                out,
                "grasps must have as many contacts as normals and friction coefficients, the same \
                 number for each centre of mass, got {points} contacts, {normals} normals and \
                 {frictions} friction coefficients for {centers} centres of mass"
            ),
            Error::Count { name, wanted, got } => {
                write!(out, "{name} must hold {wanted} numbers, got {got}")
            }
            Error::NotConverged {
                grasp,
                lower,
                upper,
            } => write!(
                out,
                "contacts must be a grasp whose quality can be computed, got one (number {grasp}) \
                 of which rounding leaves open where in [{lower}, {upper}] it lies"
            ),
            Error::Tolerance { got } => {
                write!(out, "tolerance must be a positive number, got {got}")
            }
            Error::Bins { got } => write!(out, "bins must be at least 1, got {got}"),
            Error::Interrupted => write!(out, "interrupted"),
        }
    }
}

impl std::error::Error for Error {}
