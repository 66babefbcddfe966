//! Python binding: borrow, release the interpreter, call, map the error. Arguments come checked
//! from `graspmoduli/_arrays.py`; arrays are contiguous float64.

mod domain;
mod limits;
mod math;
mod moduli;
mod pool;
mod quality;
mod search;
mod surfaces;
mod touch;

use graspmoduli::error::Error;
use graspmoduli::{FrictionCone, Norm};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

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
/// edges; torsion; whether every finger has a limit of its own. Wrong ones are refused on the way in.
pub struct Cone(FrictionCone);

impl<'a, 'py> FromPyObject<'a, 'py> for Cone {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let (frictions, edges, torsion, each): (Vec<f64>, usize, f64, bool) = given.extract()?;
        Self::new(&frictions, edges, torsion, each)
    }
}

impl Cone {
    fn new(frictions: &[f64], edges: usize, torsion: f64, each: bool) -> PyResult<Self> {
        let norm = if each { Norm::Each } else { Norm::Sum };
        let cone = FrictionCone::each(frictions, edges).and_then(|cone| cone.soft(torsion));
        Ok(Self(cone.map_err(raise)?.with_norm(norm)))
    }
}

/// Rows of equal length as an array.
fn table<'py, const N: usize>(
    py: Python<'py>,
    rows: Vec<[f64; N]>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let count = rows.len();
    PyArray1::from_vec(py, rows.into_flattened()).reshape([count, N])
}

/// The compiled kernels of graspmoduli.
#[pymodule]
mod _core {
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        super::pool::remember_process();
        module.add("MOST_EACH", graspmoduli::quality::MOST_EACH)?;
        Ok(())
    }

    #[pymodule_export]
    use super::GraspModuliError;
    #[pymodule_export]
    use super::domain::{
        fill_configurations, fill_nearby, grasps_near, random_grasps, smallest_nearby, survey,
    };
    #[pymodule_export]
    use super::limits::{pairs_allowed, places_allowed};
    #[pymodule_export]
    use super::math::{
        arctan2, cos, exp, instructions, interpolate, normal_equations, power, sin, solve_banded,
    };
    #[pymodule_export]
    use super::moduli::{PyDeformation, surface_distance, transfer_bound};
    #[pymodule_export]
    use super::quality::{
        certified_radius, circular_quality, contact_forces, extreme_quality, is_clean, quality,
        quality_at_least, quality_gradient, quality_of_one, quality_of_wrenches, tangents,
        task_gradient, task_quality, weakest,
    };
    #[pymodule_export]
    use super::search::{best_subsets, synthesize, synthesize_many};
    #[pymodule_export]
    use super::surfaces::{Surface, combine, sample_points};
    #[pymodule_export]
    use super::touch::Mesh;
}
