//! What is on its way back from the device.

#[cfg(not(target_arch = "wasm32"))]
use girandole_core::slices::complete;
#[cfg(target_arch = "wasm32")]
use girandole_core::slices::pause;
use std::future::Future;
use std::pin::Pin;
use std::task::{Context, Poll, Waker};

/// A future that is looked at once a frame.
pub struct Pending<T>(Pin<Box<dyn Future<Output = T>>>);

impl<T> Pending<T> {
    pub fn new(future: impl Future<Output = T> + 'static) -> Self {
        Self(Box::pin(future))
    }

    /// The result, once: when it is there.
    pub fn take(&mut self) -> Option<T> {
        match self.0.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(value) => Some(value),
            Poll::Pending => None,
        }
    }
}

/// The result of a slot, which is empty afterwards, if it is there.
pub fn take<T>(slot: &mut Option<Pending<T>>) -> Option<T> {
    let value = slot.as_mut()?.take()?;
    *slot = None;
    Some(value)
}

/// The result of a function that is called on a thread of its own. In browsers it is called between frames, a slice after each, and again
/// once files are there that it lacks.
pub fn beside<T: Send + 'static>(f: impl AsyncFnMut() -> T + Send + 'static) -> Pending<T> {
    #[cfg(target_arch = "wasm32")]
    let result = async move {
        pause().await;
        girandole::browser::gather(f).await
    };
    #[cfg(not(target_arch = "wasm32"))]
    let result = {
        let mut f = f;
        let (sender, receiver) = std::sync::mpsc::channel();
        std::thread::spawn(move || sender.send(complete(f())));
        std::future::poll_fn(move |_| match receiver.try_recv() {
            Ok(value) => std::task::Poll::Ready(value),
            Err(_) => std::task::Poll::Pending,
        })
    };
    Pending::new(result)
}
