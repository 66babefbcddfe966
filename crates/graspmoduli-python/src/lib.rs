//! Python binding: borrow, release the interpreter, call, map the error. Arguments come checked
//! from `graspmoduli/_arrays.py`; arrays are contiguous float64.

mod domain;
mod math;
mod pool;
mod quality;
mod touch;

use graspmoduli::contact::{FrictionCone, Norm};
use graspmoduli::distance;
use graspmoduli::error::Error;
use graspmoduli::guarantees;
use graspmoduli::region::{Anywhere, Cells, Region};
use graspmoduli::search;
use graspmoduli::synthesis;
use graspmoduli::transfer::{Carried, Deformation, Schedule};
use graspmoduli::{sampling, surface};
use numpy::{
    PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3,
};
use pool::{detached, interruptible};
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;
use std::ops::ControlFlow;
use std::sync::atomic::Ordering;

pyo3::create_exception!(
    graspmoduli,
    GraspModuliError,
    PyValueError,
    "Wrong input: names the argument, what was wanted and what came."
);

fn raise(error: Error) -> PyErr {
    GraspModuliError::new_err(error.to_string())
}

fn vectors(values: &[f64]) -> &[[f64; 3]] {
    values.as_chunks().0
}

/// The friction cones of a call, from a tuple: coefficients, one for all contacts or one each;
/// edges; torsion; whether every finger has a limit of its own.
#[derive(FromPyObject)]
pub struct Cone(Vec<f64>, usize, f64, bool);

impl Cone {
    fn build(&self) -> PyResult<FrictionCone> {
        FrictionCone::each(&self.0, self.1)
            .and_then(|cone| cone.soft(self.2))
            .map(|cone| cone.with_norm(if self.3 { Norm::Each } else { Norm::Sum }))
            .map_err(raise)
    }
}

/// The friction cone of hard or soft fingers.
fn cone(friction: f64, edges: usize, torsion: f64) -> PyResult<FrictionCone> {
    FrictionCone::new(friction, edges)
        .and_then(|cone| cone.soft(torsion))
        .map_err(raise)
}

/// Rows of equal length as an array.
fn table<'py, const N: usize>(
    py: Python<'py>,
    rows: Vec<[f64; N]>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let count = rows.len();
    PyArray1::from_vec(py, rows.into_flattened()).reshape([count, N])
}

/// A surface with cylindrical coordinates.
#[pyclass(frozen)]
struct Surface(surface::Surface);

#[pymethods]
impl Surface {
    #[new]
    fn new(bottom: f64, top: f64, coefficients: PyReadonlyArray2<'_, f64>) -> PyResult<Self> {
        let columns = coefficients.as_array().ncols();
        let values = coefficients.as_slice()?.to_vec();
        let surface = surface::Surface::new(bottom, top, columns, values).map_err(raise)?;
        Ok(Self(surface))
    }

    #[getter]
    fn bottom(&self) -> f64 {
        self.0.bottom()
    }

    #[getter]
    fn top(&self) -> f64 {
        self.0.top()
    }

    #[getter]
    fn coefficients<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (rows, columns) = self.0.shape();
        PyArray1::from_slice(py, self.0.coefficients()).reshape([rows, columns])
    }

    #[getter]
    fn is_revolution(&self) -> bool {
        self.0.is_revolution()
    }

    /// Per (u, θ): f, f_u, f_θ, f_uu, f_uθ, f_θθ.
    fn radius<'py>(
        &self,
        py: Python<'py>,
        u: PyReadonlyArray1<'py, f64>,
        theta: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let points = u.as_slice()?.iter().zip(theta.as_slice()?);
        let rows = points.map(|(&u, &theta)| {
            let r = self.0.radius(u, theta);
            [
                r.value, r.slope[0], r.slope[1], r.bend[0], r.bend[1], r.bend[2],
            ]
        });
        table(py, py.detach(|| rows.collect()))
    }

    /// Per (u, θ): point, normal, t₁, t₂, n_u, n_θ, c_uu, c_uθ, c_θθ.
    fn place<'py>(
        &self,
        py: Python<'py>,
        u: PyReadonlyArray1<'py, f64>,
        theta: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let points = u.as_slice()?.iter().zip(theta.as_slice()?);
        let rows = points.map(|(&u, &theta)| {
            let placed = self.0.place(u, theta);
            let [t1, t2] = placed.tangents;
            let [n1, n2] = placed.normal_slopes;
            let [uu, ut, tt] = self.0.second_derivatives(u, theta);
            let contact = placed.contact;
            let mut row = [0.0; 27];
            let vectors = [contact.point, contact.normal, t1, t2, n1, n2, uu, ut, tt];
            for (slot, vector) in row.chunks_exact_mut(3).zip(vectors) {
                slot.copy_from_slice(&vector.to_array());
            }
            row
        });
        table(py, py.detach(|| rows.collect()))
    }

    /// Area, centre of mass, volume, centre of mass of the solid; by Simpson's rule if `steps`.
    #[pyo3(signature = (steps=None))]
    fn integrals(&self, py: Python<'_>, steps: Option<usize>) -> (f64, [f64; 3], f64, [f64; 3]) {
        let integrals = py.detach(|| match steps {
            Some(steps) => self.0.integrals_by_simpson(steps),
            None => *self.0.integrals(),
        });
        (
            integrals.area,
            integrals.center_of_mass.to_array(),
            integrals.volume,
            integrals.solid_center_of_mass.to_array(),
        )
    }

    fn radius_about(&self, py: Python<'_>, center: [f64; 3]) -> f64 {
        py.detach(|| self.0.radius_about(center.into(), 64))
    }

    fn project(&self, py: Python<'_>) -> Self {
        Self(py.detach(|| self.0.project()))
    }
}

/// Σ weight·surface in the convex cone.
#[pyfunction]
fn combine(py: Python<'_>, weights: Vec<f64>, surfaces: Vec<Py<Surface>>) -> PyResult<Surface> {
    let surfaces: Vec<_> = surfaces.iter().map(|surface| &surface.get().0).collect();
    let terms: Vec<_> = weights.into_iter().zip(surfaces).collect();
    py.detach(|| surface::Surface::combine(&terms))
        .map(Surface)
        .map_err(raise)
}

/// Maps points of the unit square to (u, θ), equal areas to equal areas.
#[pyfunction]
fn sample_points<'py>(
    py: Python<'py>,
    surface: &Surface,
    square: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let square = square.as_slice()?.as_chunks().0;
    /// Points between two looks at the signals.
    const PIECE: usize = 1 << 14;
    if square.len() <= PIECE {
        let points = detached(py, || sampling::by_area(&surface.0, square));
        return table(py, points);
    }
    let points = interruptible(py, |stop| {
        let mut points = Vec::with_capacity(square.len());
        for piece in square.chunks(PIECE) {
            if stop.load(Ordering::Relaxed) {
                return Err(Error::Interrupted);
            }
            points.extend(sampling::by_area(&surface.0, piece));
        }
        Ok(points)
    })?;
    table(py, points)
}

/// The best of all subsets of `size` of n contacts: indices and qualities. `progress` is called with
/// the numbers of subsets done and in all.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the kernel's arguments, flat")]
fn best_subsets<'py>(
    py: Python<'py>,
    contacts: PyReadonlyArray2<'py, f64>,
    normals: PyReadonlyArray2<'py, f64>,
    frictions: Option<PyReadonlyArray1<'py, f64>>,
    center_of_mass: [f64; 3],
    cone: Cone,
    size: usize,
    top: usize,
    threads: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<Vec<(Vec<usize>, f64)>> {
    let cone = cone.build()?;
    let frictions = match &frictions {
        Some(each) => each.as_slice()?,
        None => &[],
    };
    let contacts = quality::contacts(vectors(contacts.as_slice()?), vectors(normals.as_slice()?));
    let mut failure = None;
    let result = py.detach(|| {
        let report = |done, total| {
            let outcome = Python::attach(|py| {
                py.check_signals()?;
                progress
                    .as_ref()
                    .map_or(Ok(()), |call| call.call1(py, (done, total)).map(drop))
            });
            match outcome {
                Ok(()) => ControlFlow::Continue(()),
                Err(error) => {
                    failure = Some(error);
                    ControlFlow::Break(())
                }
            }
        };
        let center = center_of_mass.into();
        search::best_subsets(
            &contacts, frictions, center, &cone, size, top, threads, report,
        )
    });
    match (result, failure) {
        (Ok(ranked), _) => Ok(ranked.into_iter().map(|r| (r.indices, r.quality)).collect()),
        (Err(_), Some(error)) => Err(error),
        (Err(Error::Interrupted), None) => Err(PyKeyboardInterrupt::new_err(())),
        (Err(error), None) => Err(raise(error)),
    }
}

/// Synthesized grasps, best first: per row u₁, θ₁, u₂, θ₂, u₃, θ₃, quality.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the kernel's arguments, flat")]
fn synthesize<'py>(
    py: Python<'py>,
    surface: &Surface,
    center_of_mass: [f64; 3],
    cone: Cone,
    top: usize,
    starts: usize,
    square: PyReadonlyArray2<'py, f64>,
    allowed: Option<PyReadonlyArray2<'py, bool>>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let cone = cone.build()?;
    let square = square.as_slice()?.as_chunks().0;
    let cells = cells(allowed.as_ref())?;
    let found = interruptible(py, |stop| {
        synthesis::synthesize(
            &surface.0,
            center_of_mass.into(),
            &cone,
            region(cells.as_ref()),
            top,
            starts,
            square,
            stop,
        )
    })?;
    let rows = found.into_iter().map(|grasp| {
        let [[u1, t1], [u2, t2], [u3, t3]] = grasp.coordinates;
        [u1, t1, u2, t2, u3, t3, grasp.quality]
    });
    table(py, rows.collect())
}

fn cells<'a>(allowed: Option<&'a PyReadonlyArray2<'_, bool>>) -> PyResult<Option<Cells<'a>>> {
    let Some(allowed) = allowed else {
        return Ok(None);
    };
    Ok(Some(Cells {
        allowed: allowed.as_slice()?,
        columns: allowed.as_array().ncols(),
    }))
}

fn region<'a>(cells: Option<&'a Cells<'a>>) -> &'a dyn Region {
    cells.map_or(&Anywhere, |cells| cells)
}

/// d(S, S') to a relative error: value, its error bound, and where it is attained.
#[pyfunction]
fn surface_distance(
    py: Python<'_>,
    first: Py<Surface>,
    second: Py<Surface>,
    tolerance: f64,
) -> PyResult<(f64, f64, [f64; 2])> {
    let (first, second) = (&first.get().0, &second.get().0);
    let found = heeding_signals(py, |progress| {
        distance::surface_distance(first, second, tolerance, progress)
    })?;
    Ok((found.value, found.error, found.at))
}

/// How far any grasp moves by the naïve transfer: d(S, S'), or the way of the centre of mass.
#[pyfunction]
fn transfer_bound(
    py: Python<'_>,
    source: Py<Surface>,
    target: Py<Surface>,
    tolerance: f64,
) -> PyResult<f64> {
    let (source, target) = (&source.get().0, &target.get().0);
    heeding_signals(py, |progress| {
        guarantees::transfer_bound(source, target, tolerance, progress)
    })
}

/// Releases the interpreter for work that asks now and then whether to go on: not after Ctrl-C.
fn heeding_signals<R: Send>(
    py: Python<'_>,
    work: impl FnOnce(&mut dyn FnMut() -> ControlFlow<()>) -> Result<R, Error> + Send,
) -> PyResult<R> {
    let mut failure = None;
    let result = py.detach(|| {
        work(&mut || match Python::attach(|py| py.check_signals()) {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                failure = Some(error);
                ControlFlow::Break(())
            }
        })
    });
    match (result, failure) {
        (Ok(found), _) => Ok(found),
        (Err(_), Some(error)) => Err(error),
        (Err(error), None) => Err(raise(error)),
    }
}

/// A grasp carried to another surface: coordinates (m, 2), path (k, 2) of t and Q_l, evaluations.
type Transferred<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>, usize);

/// The surfaces between two.
#[pyclass(frozen, name = "Deformation")]
struct PyDeformation(Deformation);

#[pymethods]
impl PyDeformation {
    #[new]
    fn new(py: Python<'_>, source: Py<Surface>, target: Py<Surface>) -> PyResult<Self> {
        py.detach(|| Deformation::new(&source.get().0, &target.get().0))
            .map(Self)
            .map_err(raise)
    }

    /// The naïve transfer of n grasps, (n, m, 2), with Q_l at `samples` + 1 values of t.
    fn naive<'py>(
        &self,
        py: Python<'py>,
        grasps: PyReadonlyArray3<'py, f64>,
        cone: Cone,
        samples: usize,
    ) -> PyResult<Vec<Transferred<'py>>> {
        let cone = cone.build()?;
        let grasps = coordinates(&grasps)?;
        let carried = interruptible(py, |stop| self.0.naive(&grasps, &cone, samples, stop))?;
        transferred(py, carried)
    }

    /// The gradient method of Sec. IV.D.
    #[expect(clippy::too_many_arguments, reason = "the kernel's arguments, flat")]
    fn by_gradient<'py>(
        &self,
        py: Python<'py>,
        grasps: PyReadonlyArray3<'py, f64>,
        cone: Cone,
        surfaces: usize,
        steps: usize,
        length: f64,
        difference: Option<f64>,
    ) -> PyResult<Vec<Transferred<'py>>> {
        let cone = cone.build()?;
        let grasps = coordinates(&grasps)?;
        let schedule = Schedule {
            surfaces,
            steps,
            length,
            difference,
        };
        let carried = interruptible(py, |stop| {
            self.0.by_gradient(&grasps, &cone, schedule, stop)
        })?;
        transferred(py, carried)
    }

    /// The ascent by all facets near the origin, for three contacts; on the target contacts lie in
    /// the `allowed` cells.
    fn by_ascent<'py>(
        &self,
        py: Python<'py>,
        grasps: PyReadonlyArray3<'py, f64>,
        cone: Cone,
        allowed: Option<PyReadonlyArray2<'py, bool>>,
    ) -> PyResult<Vec<Transferred<'py>>> {
        let cone = cone.build()?;
        let grasps: Vec<_> = coordinates(&grasps)?
            .iter()
            .map(|grasp| [grasp[0], grasp[1], grasp[2]])
            .collect();
        let cells = cells(allowed.as_ref())?;
        let carried = interruptible(py, |stop| {
            let region = region(cells.as_ref());
            self.0.by_ascent(&grasps, &cone, region, stop)
        })?;
        transferred(py, carried)
    }
}

/// Contact coordinates of n grasps.
fn coordinates(grasps: &PyReadonlyArray3<'_, f64>) -> PyResult<Vec<Vec<[f64; 2]>>> {
    let m = grasps.as_array().shape()[1];
    let pairs: &[[f64; 2]] = grasps.as_slice()?.as_chunks().0;
    Ok(pairs.chunks_exact(m).map(<[_]>::to_vec).collect())
}

fn transferred(py: Python<'_>, carried: Vec<Carried>) -> PyResult<Vec<Transferred<'_>>> {
    carried
        .into_iter()
        .map(|c| Ok((table(py, c.coordinates)?, table(py, c.path)?, c.evaluations)))
        .collect()
}

/// The compiled kernels of graspmoduli.
#[pymodule]
mod _core {
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(_module: &Bound<'_, PyModule>) -> PyResult<()> {
        super::pool::remember_process();
        Ok(())
    }

    #[pymodule_export]
    use super::domain::{
        fill_configurations, fill_nearby, grasps_near, random_grasps, smallest_nearby, survey,
    };
    #[pymodule_export]
    use super::math::{arctan2, cos, exp, instructions, interpolate, power, sin, solve_banded};
    #[pymodule_export]
    use super::quality::{
        certified_radius, circular_quality, contact_forces, extreme_quality, is_clean, quality,
        quality_at_least, quality_gradient, quality_of_one, tangents, weakest,
    };
    #[pymodule_export]
    use super::touch::Mesh;
    #[pymodule_export]
    use super::{
        GraspModuliError, PyDeformation, Surface, best_subsets, combine, sample_points,
        surface_distance, synthesize, transfer_bound,
    };
}
