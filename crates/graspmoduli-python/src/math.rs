//! Elementary functions, interpolation and banded systems with the same bits on every processor.

use crate::GraspModuliError;
use graspmoduli::{interpolation, math};
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArray1,
    PyReadonlyArray2, PyReadonlyArrayDyn, PyUntypedArrayMethods,
};
use pyo3::prelude::*;

type Array<'py> = Bound<'py, PyArrayDyn<f64>>;

#[pyfunction]
pub fn sin<'py>(py: Python<'py>, x: PyReadonlyArrayDyn<'py, f64>) -> Array<'py> {
    x.as_array().mapv(math::sin).into_pyarray(py)
}

#[pyfunction]
pub fn cos<'py>(py: Python<'py>, x: PyReadonlyArrayDyn<'py, f64>) -> Array<'py> {
    x.as_array().mapv(math::cos).into_pyarray(py)
}

#[pyfunction]
pub fn exp<'py>(py: Python<'py>, x: PyReadonlyArrayDyn<'py, f64>) -> Array<'py> {
    x.as_array().mapv(math::exp).into_pyarray(py)
}

#[pyfunction]
pub fn power<'py>(py: Python<'py>, x: PyReadonlyArrayDyn<'py, f64>, exponent: f64) -> Array<'py> {
    let power = |x| math::pow(x, exponent);
    x.as_array().mapv(power).into_pyarray(py)
}

/// Angles of points in the plane, elementwise.
#[pyfunction]
pub fn arctan2<'py>(
    py: Python<'py>,
    y: PyReadonlyArray1<'py, f64>,
    x: PyReadonlyArray1<'py, f64>,
) -> Bound<'py, PyArray1<f64>> {
    let pairs = y.as_array().into_iter().zip(x.as_array());
    let angles: Vec<f64> = pairs.map(|(&y, &x)| math::atan2(y, x)).collect();
    angles.into_pyarray(py)
}

/// Coefficients of the spline surface with these radii at the Greville sites and the angles 2πj/n.
#[pyfunction]
pub fn interpolate<'py>(
    py: Python<'py>,
    values: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let shape = [values.shape()[0], values.shape()[1]];
    let slice = values.as_slice()?;
    let found = py.detach(|| interpolation::interpolate(shape[1], slice));
    found.into_pyarray(py).reshape(shape)
}

/// The lower band and the right-hand side of a regression's normal equations.
///
/// `cells` and `design` have a row of 16 for each point.
#[pyfunction]
#[allow(clippy::type_complexity)]
pub fn normal_equations<'py>(
    py: Python<'py>,
    count: usize,
    stride: usize,
    cells: PyReadonlyArray2<'py, u32>,
    design: PyReadonlyArray2<'py, f64>,
    weights: PyReadonlyArray1<'py, f64>,
    values: PyReadonlyArray1<'py, f64>,
) -> PyResult<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>)> {
    let (cells, design) = (cells.as_slice()?, design.as_slice()?);
    let (weights, values) = (weights.as_slice()?, values.as_slice()?);
    let (band, right) = py
        .detach(|| interpolation::normal_equations(count, stride, cells, design, weights, values));
    Ok((
        band.into_pyarray(py).reshape([count, stride])?,
        right.into_pyarray(py),
    ))
}

/// The solution of a symmetric positive system, given by its lower band: a row per unknown.
#[pyfunction]
pub fn solve_banded<'py>(
    py: Python<'py>,
    band: PyReadonlyArray2<'py, f64>,
    right: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let width = band.shape()[1] - 1;
    let (band, right) = (band.as_slice()?.to_vec(), right.as_slice()?.to_vec());
    py.detach(|| interpolation::solve_banded(width, band, right))
        .map(|found| found.into_pyarray(py))
        .ok_or_else(|| GraspModuliError::new_err("object must determine a surface, got too little"))
}

/// The kernel's instruction set.
#[pyfunction]
pub fn instructions() -> &'static str {
    graspmoduli::quality::instructions_name()
}
