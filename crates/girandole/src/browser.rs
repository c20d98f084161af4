//! What a browser does for programs in its pages: fetches files, decodes pictures beside everything else.

use girandole_core::files::{self, Decoded};
use js_sys::{Array, Promise, Uint8Array};
use std::cell::RefCell;
use std::path::Path;
use wasm_bindgen::JsCast;
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;
use web_sys::{Blob, MessageEvent, Response, Url, Worker};

const DECODER: &str = include_str!("browser/decoder.js");

/// Does something that reads files, loading a scene for one, and does it again once what it lacks is there: the names of files that
/// are not [held](files::hold) are addresses, relative to the page's.
pub async fn gather<T>(act: impl AsyncFnMut() -> T) -> T {
    let decoder = Decoder::default();
    files::gather(act, fetch, async |bytes: &[u8]| decoder.decode(bytes).await).await
}

/// The bytes at an address.
async fn fetch(address: &Path) -> Result<Vec<u8>, String> {
    let window = web_sys::window().ok_or("there is no window to fetch with")?;
    let response = JsFuture::from(window.fetch_with_str(&address.to_string_lossy())).await;
    let response: Response = response
        .map_err(|_| "it is not there, or its server does not let other pages have it")?
        .unchecked_into();
    if !response.ok() {
        return Err(format!("its server says {}", response.status()));
    }
    let bytes = JsFuture::from(response.array_buffer().map_err(said)?).await.map_err(said)?;
    Ok(Uint8Array::new(&bytes).to_vec())
}

/// A worker with the address of its program, started at the first picture.
#[derive(Default)]
struct Decoder(RefCell<Option<(Worker, String)>>);

impl Decoder {
    async fn decode(&self, bytes: &[u8]) -> Result<Decoded, String> {
        let held = self.0.take();
        let (worker, address) = held.map_or_else(start, Ok)?;
        worker.post_message(&Uint8Array::from(bytes)).map_err(said)?;
        let answer = Promise::new(&mut |resolve, reject| {
            let take = Closure::once_into_js(move |event: MessageEvent| {
                // What is settled takes nothing.
                let _ = resolve.call1(&JsValue::NULL, &event.data());
            });
            worker.set_onmessage(Some(take.unchecked_ref()));
            worker.set_onerror(Some(&reject));
        });
        let answer = JsFuture::from(answer).await;
        // One that failed, for want of permission for one, would not answer again.
        if answer.is_ok() {
            self.0.replace(Some((worker, address)));
        } else {
            end(&worker, &address);
        }
        let answer = answer.map_err(|_| "the page's worker failed; allow it `worker-src blob:`")?;
        if let Some(why) = answer.as_string() {
            return Err(why);
        }
        let answer: Array = answer.unchecked_into();
        let side = |index: u32| answer.get(index).as_f64().unwrap_or_default() as u32;
        let size = [side(0), side(1)];
        let texels: Uint8Array = answer.get(2).unchecked_into();
        let copied = move || {
            let mut copy = vec![[0; 4]; texels.length() as usize / 4];
            texels.copy_to(copy.as_flattened_mut());
            copy
        };
        Ok(Decoded { size, texels: Box::new(copied) })
    }
}

impl Drop for Decoder {
    fn drop(&mut self) {
        if let Some((worker, address)) = self.0.take() {
            end(&worker, &address);
        }
    }
}

fn end(worker: &Worker, address: &str) {
    worker.terminate();
    // It was there, or nobody misses it.
    let _ = Url::revoke_object_url(address);
}

fn start() -> Result<(Worker, String), String> {
    let script = Blob::new_with_str_sequence(&Array::of1(&DECODER.into())).map_err(said)?;
    let address = Url::create_object_url_with_blob(&script).map_err(said)?;
    Ok((Worker::new(&address).map_err(said)?, address))
}

fn said(error: JsValue) -> String {
    match error.dyn_ref::<js_sys::Error>() {
        Some(error) => String::from(error.message()),
        None => format!("{error:?}"),
    }
}
