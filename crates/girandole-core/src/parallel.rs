//! Work on all cores, the results in order whatever the number of threads. Without the feature `parallel`, on one.

use crate::slices::pause;

#[cfg(feature = "parallel")]
use rayon::prelude::*;

/// Fewer small pieces of work are not worth a core.
#[cfg(feature = "parallel")]
const LEAST: usize = 16;

/// A function of 0 to `count`: many small pieces of work.
pub(crate) fn in_order<T: Send>(count: usize, f: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
    #[cfg(feature = "parallel")]
    {
        (0..count).into_par_iter().with_min_len(LEAST).map(f).collect()
    }
    #[cfg(not(feature = "parallel"))]
    (0..count).map(f).collect()
}

/// The same in slices: of so many on each core.
pub(crate) async fn in_slices<T: Send>(
    count: usize,
    each: usize,
    f: impl Fn(usize) -> T + Sync + Send,
) -> Vec<T> {
    #[cfg(feature = "parallel")]
    let slice = each * rayon::current_num_threads();
    #[cfg(not(feature = "parallel"))]
    let slice = each;
    let mut result = Vec::with_capacity(count);
    for first in (0..count).step_by(slice) {
        if first > 0 {
            pause().await;
        }
        let slice = first..count.min(first + slice);
        #[cfg(feature = "parallel")]
        result.par_extend(slice.into_par_iter().with_min_len(LEAST.min(each / 4)).map(&f));
        #[cfg(not(feature = "parallel"))]
        result.extend(slice.map(&f));
    }
    result
}

/// One result for each item: a few large pieces of work.
pub(crate) fn map<T: Sync, R: Send>(items: &[T], f: impl Fn(&T) -> R + Sync + Send) -> Vec<R> {
    #[cfg(feature = "parallel")]
    {
        items.par_iter().with_max_len(1).map(f).collect()
    }
    #[cfg(not(feature = "parallel"))]
    items.iter().map(f).collect()
}

/// Does something to each item: a few large pieces of work.
pub(crate) fn for_each<T: Send>(items: Vec<T>, f: impl Fn(T) + Sync + Send) {
    #[cfg(feature = "parallel")]
    items.into_par_iter().with_max_len(1).for_each(f);
    #[cfg(not(feature = "parallel"))]
    items.into_iter().for_each(f);
}

/// Two pieces of work that do not concern each other.
pub(crate) fn both<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    #[cfg(feature = "parallel")]
    {
        rayon::join(a, b)
    }
    #[cfg(not(feature = "parallel"))]
    (a(), b())
}
