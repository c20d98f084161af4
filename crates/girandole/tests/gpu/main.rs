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
use libtest_mimic::{Arguments, Failed, Trial};
use std::panic::AssertUnwindSafe;

fn main() {
    let mut arguments = Arguments::from_args();
    // The adapter uses all cores by itself, and memory for one atlas at a time.
    arguments.test_threads = Some(1);
    let adapter = pollster::block_on(girandole::Gpu::new(None));
    if let Err(error) = &adapter {
        eprintln!("tests that need an adapter are ignored: {error}");
    }
    let context: Option<&'static Context> = adapter.ok().map(|gpu| &*Box::leak(Box::new(Context { gpu })));
    let of_any_device = [
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
    // What a device has to have been created with for some; without it they are ignored.
    let of_some_devices =
        [exact::with_clip_distances(), selected::with_float_blending(), materials::with_timestamps()];
    let tests = of_any_device.into_iter().map(|test| (test, wgpu::Features::empty()));
    let tests = tests.chain(of_some_devices.map(|(features, test)| (test, features)));
    let trials = tests
        .map(|((name, test), features)| {
            let can_run = context.is_some_and(|c| c.gpu.device.features().contains(features));
            if context.is_some() && !can_run {
                eprintln!("{name} is ignored: the device lacks {features:?}");
            }
            Trial::test(name, move || {
                let context = context.filter(|_| can_run).ok_or("no adapter, or it lacks what is tested")?;
                std::panic::catch_unwind(AssertUnwindSafe(|| test(context))).map_err(|payload| {
                    let text = payload.downcast_ref::<String>().cloned();
                    Failed::from(
                        text.or_else(|| payload.downcast_ref::<&str>().map(|s| s.to_string()))
                            .unwrap_or_default(),
                    )
                })
            })
            .with_ignored_flag(!can_run)
        })
        .collect();
    libtest_mimic::run(&arguments, trials).exit();
}
