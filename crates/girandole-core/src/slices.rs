//! Work in slices: futures that return to whoever polls them every few milliseconds, so that a window can draw meanwhile. They wait for
//! nothing, and read no clock: who polls goes on as long as there is time.

use std::future::poll_fn;
use std::pin::{Pin, pin};
use std::task::{Context, Poll, Waker};

/// Work that can be left and gone on with.
pub struct Slices<T>(Pin<Box<dyn Future<Output = T> + Send>>);

impl<T> Slices<T> {
    /// Begins nothing yet.
    pub fn new(work: impl Future<Output = T> + Send + 'static) -> Self {
        Self(Box::pin(work))
    }

    /// Goes on by a slice; what comes of the work after the last one.
    pub fn step(&mut self) -> Option<T> {
        match self.0.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(result) => Some(result),
            Poll::Pending => None,
        }
    }
}

/// The end of a slice.
pub async fn pause() {
    let mut is_over = false;
    poll_fn(|context| {
        if std::mem::replace(&mut is_over, true) {
            return Poll::Ready(());
        }
        context.waker().wake_by_ref();
        Poll::Pending
    })
    .await
}

/// All slices at once.
pub fn complete<T>(work: impl Future<Output = T>) -> T {
    let mut work = pin!(work);
    loop {
        if let Poll::Ready(result) = work.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            return result;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pause_is_the_end_of_a_slice() {
        let work = async {
            for _ in 0..3 {
                pause().await;
            }
            "done"
        };
        let mut slices = Slices::new(work);
        let results: Vec<_> = (0..4).map(|_| slices.step()).collect();
        assert_eq!(results, [None, None, None, Some("done")]);
    }

    #[test]
    fn all_slices_can_be_made_at_once() {
        assert_eq!(complete(async { pause().await }), ());
        assert_eq!(complete(async { 7 }), 7);
    }
}
