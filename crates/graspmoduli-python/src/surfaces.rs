//! Surfaces, their sums, and points on them.

use crate::pool::{detached, interruptible};
use crate::{raise, table};
use graspmoduli::error::Error;
use graspmoduli::{sampling, surface};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use std::sync::atomic::Ordering;

/// A surface with cylindrical coordinates.
#[pyclass(frozen)]
pub struct Surface(pub surface::Surface);

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
pub fn combine(py: Python<'_>, weights: Vec<f64>, surfaces: Vec<Py<Surface>>) -> PyResult<Surface> {
    let surfaces: Vec<_> = surfaces.iter().map(|surface| &surface.get().0).collect();
    let terms: Vec<_> = weights.into_iter().zip(surfaces).collect();
    py.detach(|| surface::Surface::combine(&terms))
        .map(Surface)
        .map_err(raise)
}

/// Maps points of the unit square to (u, θ), equal areas to equal areas.
#[pyfunction]
pub fn sample_points<'py>(
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
