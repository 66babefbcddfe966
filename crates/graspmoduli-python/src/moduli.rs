//! Shapes and grasps as one space: distances, and grasps carried along its curves.

use crate::pool::{heeding_signals, interruptible};
use crate::search::{cells, region};
use crate::surfaces::Surface;
use crate::{Cone, raise, table};
use graspmoduli::distance;
use graspmoduli::guarantees;
use graspmoduli::transfer::{Carried, Deformation, Schedule};
use numpy::{PyArray2, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;

/// d(S, S') to a relative error: value, its error bound, and where it is attained.
#[pyfunction]
pub fn surface_distance(
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
pub fn transfer_bound(
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

/// A grasp carried to another surface: coordinates (m, 2), path (k, 2) of t and Q_l, evaluations.
pub type Transferred<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>, usize);

/// The surfaces between two.
#[pyclass(frozen, name = "Deformation")]
pub struct PyDeformation(Deformation);

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
        let Cone(cone) = cone;
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
        let Cone(cone) = cone;
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
        let Cone(cone) = cone;
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
pub fn coordinates(grasps: &PyReadonlyArray3<'_, f64>) -> PyResult<Vec<Vec<[f64; 2]>>> {
    let m = grasps.as_array().shape()[1];
    let pairs: &[[f64; 2]] = grasps.as_slice()?.as_chunks().0;
    Ok(pairs.chunks_exact(m).map(<[_]>::to_vec).collect())
}

pub fn transferred(py: Python<'_>, carried: Vec<Carried>) -> PyResult<Vec<Transferred<'_>>> {
    carried
        .into_iter()
        .map(|c| Ok((table(py, c.coordinates)?, table(py, c.path)?, c.evaluations)))
        .collect()
}
