//! Many small pieces of work on all cores.

/// Fewer are not worth a core.
#[cfg(feature = "parallel")]
const LEAST: usize = 16;

/// A function of 0 to `count`, in order, whatever the number of threads.
pub(super) fn in_order<T: Send>(count: usize, f: impl Fn(usize) -> T + Send + Sync) -> Vec<T> {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        (0..count).into_par_iter().with_min_len(LEAST).map(f).collect()
    }
    #[cfg(not(feature = "parallel"))]
    (0..count).map(f).collect()
}
