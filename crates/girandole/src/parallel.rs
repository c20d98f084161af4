//! Work on all cores.

#[cfg(feature = "parallel")]
pub(crate) use self::on_all_cores::{both, in_order};
#[cfg(not(feature = "parallel"))]
pub(crate) use self::on_one_core::{both, in_order};

#[cfg(feature = "parallel")]
mod on_all_cores {
    use rayon::prelude::*;

    /// A function of each item, in order, whatever the number of threads.
    pub fn in_order<T: Sync, R: Send>(items: &[T], f: impl Fn(&T) -> R + Sync + Send) -> Vec<R> {
        items.par_iter().with_min_len(4).map(f).collect()
    }

    /// Two pieces of work that do not concern each other.
    pub fn both<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
        rayon::join(a, b)
    }
}

/// The same one after the other. In browsers what belongs to a device cannot be shared between threads.
#[cfg(not(feature = "parallel"))]
mod on_one_core {
    pub fn in_order<T, R>(items: &[T], f: impl Fn(&T) -> R) -> Vec<R> {
        items.iter().map(f).collect()
    }

    pub fn both<A, B>(a: impl FnOnce() -> A, b: impl FnOnce() -> B) -> (A, B) {
        (a(), b())
    }
}
