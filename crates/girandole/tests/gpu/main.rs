//! Tests that need an adapter (a software one will do). Where there is none, all are reported as ignored.

mod common;
mod exact;
mod leaks;
mod materials;
mod mirrors;
mod oracle;
mod pictures;
mod selected;
mod sizes;
mod truth;

use common::Context;
use girandole::DeviceTuning;
use libtest_mimic::{Arguments, Failed, Trial};
use std::panic::AssertUnwindSafe;

/// Variants of the kernels by the environment variable `GIRANDOLE_TUNING`: `gpu`, `gpu-uniform` (lights in a uniform
/// buffer, a point an invocation) or `software`; without it, as the device is.
fn tuning() -> Option<DeviceTuning> {
    let name = std::env::var("GIRANDOLE_TUNING").ok()?;
    Some(match name.as_str() {
        "gpu" => DeviceTuning::GPU,
        "gpu-uniform" => {
            DeviceTuning { lights_in_storage: false, cooperative_points: false, ..DeviceTuning::GPU }
        }
        "software" => DeviceTuning::SOFTWARE,
        other => panic!("GIRANDOLE_TUNING is `{other}`; set it to gpu, gpu-uniform or software"),
    })
}

fn main() {
    let mut arguments = Arguments::from_args();
    // The adapter uses all cores by itself, and memory for one atlas at a time.
    arguments.test_threads = Some(1);
    let adapter = pollster::block_on(girandole::Gpu::new(None));
    if let Err(error) = &adapter {
        eprintln!("tests that need an adapter are ignored: {error}");
    }
    let context: Option<&'static Context> =
        adapter.ok().map(|gpu| &*Box::leak(Box::new(Context { gpu, tuning: tuning() })));
    let tests = [
        mirrors::tests(),
        exact::tests(),
        oracle::tests(),
        leaks::tests(),
        materials::tests(),
        pictures::tests(),
        selected::tests(),
        sizes::tests(),
        truth::tests(),
    ]
    .concat();
    let trials = tests
        .into_iter()
        .map(|(name, test)| {
            Trial::test(name, move || {
                let context = context.ok_or("no adapter")?;
                std::panic::catch_unwind(AssertUnwindSafe(|| test(context))).map_err(|payload| {
                    let text = payload.downcast_ref::<String>().cloned();
                    Failed::from(
                        text.or_else(|| payload.downcast_ref::<&str>().map(|s| s.to_string()))
                            .unwrap_or_default(),
                    )
                })
            })
            .with_ignored_flag(context.is_none())
        })
        .collect();
    libtest_mimic::run(&arguments, trials).exit();
}
