//! Work on several threads: rayon's with the feature of that name, else one after the other, with
//! the same results to the bit.

#[cfg(feature = "rayon")]
pub(crate) use rayon::prelude::*;
#[cfg(not(feature = "rayon"))]
pub(crate) use serial::*;

/// Does the work on so many threads, whatever the program uses elsewhere: all that this crate does in
/// parallel runs on the threads of its caller. The results do not depend on their number.
///
/// ```
/// use graspmoduli::{Batch, FrictionCone, on_threads};
///
/// let (points, normals) = ([[1.0, 0.0, 0.0]; 3000], [[-1.0, 0.0, 0.0]; 3000]);
/// let batch = Batch { points: &points, normals: &normals, centers: &[[0.0; 3]; 1000], ..Batch::default() };
/// let cone = FrictionCone::new(0.5, 8)?;
/// let mut quality = [1.0; 1000];
/// on_threads(2, || batch.quality(&cone, &mut quality))?;
/// assert_eq!(quality, [0.0; 1000]); // all fingers at one place hold nothing
/// # Ok::<(), graspmoduli::Error>(())
/// ```
#[cfg(feature = "rayon")]
pub fn on_threads<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> R {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads.max(1));
    match builder.build() {
        Ok(pool) => pool.install(work),
        // Where the system gives no more threads there is still this one.
        Err(_) => work(),
    }
}

/// Enters the pool once, where entering it for each of many short stages would cost as much as they.
pub(crate) fn entered<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    #[cfg(feature = "rayon")]
    return rayon::scope(|_| work());
    #[cfg(not(feature = "rayon"))]
    work()
}

/// What this crate uses of rayon, on iterators.
#[cfg(not(feature = "rayon"))]
#[allow(dead_code, reason = "some of it only for meshes")]
mod serial {
    pub(crate) trait IntoParallelIterator: IntoIterator + Sized {
        fn into_par_iter(self) -> Self::IntoIter {
            self.into_iter()
        }
    }

    impl<T: IntoIterator> IntoParallelIterator for T {}

    pub(crate) trait ParallelSlice<T> {
        fn par_iter(&self) -> std::slice::Iter<'_, T>;
        fn par_chunks_mut(&mut self, size: usize) -> std::slice::ChunksMut<'_, T>;
    }

    impl<T> ParallelSlice<T> for [T] {
        fn par_iter(&self) -> std::slice::Iter<'_, T> {
            self.iter()
        }

        fn par_chunks_mut(&mut self, size: usize) -> std::slice::ChunksMut<'_, T> {
            self.chunks_mut(size)
        }
    }

    pub(crate) trait ParallelIterator: Iterator + Sized {
        fn with_min_len(self, _: usize) -> Self {
            self
        }

        fn map_init<S, R>(
            self,
            start: impl FnOnce() -> S,
            mut each: impl FnMut(&mut S, Self::Item) -> R,
        ) -> impl Iterator<Item = R> {
            let mut state = start();
            self.map(move |item| each(&mut state, item))
        }

        fn flat_map_iter<I: IntoIterator>(
            self,
            each: impl FnMut(Self::Item) -> I,
        ) -> impl Iterator<Item = I::Item> {
            self.flat_map(each)
        }

        fn try_reduce<T, E>(
            mut self,
            none: impl FnOnce() -> T,
            mut join: impl FnMut(T, T) -> Result<T, E>,
        ) -> Result<T, E>
        where
            Self: Iterator<Item = Result<T, E>>,
        {
            self.try_fold(none(), |a, b| join(a, b?))
        }
    }

    impl<I: Iterator> ParallelIterator for I {}

    pub(crate) trait ParallelExtend<T>: Extend<T> {
        fn par_extend(&mut self, more: impl IntoIterator<Item = T>) {
            self.extend(more);
        }
    }

    impl<T, C: Extend<T>> ParallelExtend<T> for C {}
}
