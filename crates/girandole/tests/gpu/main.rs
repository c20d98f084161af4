//! Tests that need an adapter (a software one will do). Where there is none, all are reported as ignored.

mod clipping;
mod common;
mod environment;
mod exact;
mod layers;
mod leaks;
mod light_motion;
mod maps;
mod materials;
mod mirror_images;
mod mirrors;
mod motion;
mod occluders;
mod opening;
mod oracle;
mod pictures;
mod rays;
mod recording;
mod refinement;
mod reflections;
mod regions;
mod rooms;
mod selected;
mod shadings;
mod sizes;
#[path = "../../../girandole-reference/tests/reference/spheres.rs"]
mod spheres;
mod staleness;
mod transfer;
mod truth;
mod viewports;

use common::{Context, Test};
use girandole::Tier;
use libtest_mimic::{Arguments, Conclusion, Failed, Trial};
use std::panic::AssertUnwindSafe;
use std::sync::Mutex;
use std::time::Instant;

/// The variants of the kernels that every test of pictures runs in: those of GPUs, and those of software drivers. Whatever
/// the device is, both run on it; but where the environment variable `GIRANDOLE_TEST_DEVICE` names it
/// (`cargo xtask test --adapter` does): there those that are chosen for it run, as `device`.
const TIERS: [(&str, Tier); 2] = [("gpu", Tier::Gpu), ("software", Tier::Software)];

/// How many tests the last lines name with their times.
const SLOWEST: usize = 10;

/// The seconds that every test took, with its name.
static TIMES: Mutex<Vec<(f32, String)>> = Mutex::new(Vec::new());

/// What a device has to have been created with for a test; without it the test is ignored.
type Requirement = wgpu::Features;

/// All tests of pictures.
fn pictures() -> Vec<(Test, Requirement)> {
    let of_any_device = [
        clipping::tests(),
        exact::tests(),
        opening::tests(),
        oracle::tests(),
        layers::tests(),
        leaks::tests(),
        light_motion::tests(),
        materials::tests(),
        mirror_images::tests(),
        pictures::tests(),
        motion::tests(),
        occluders::tests(),
        environment::tests(),
        rays::tests(),
        recording::tests(),
        refinement::tests(),
        reflections::tests(),
        regions::tests(),
        rooms::tests(),
        selected::tests(),
        shadings::tests(),
        sizes::tests(),
        staleness::tests(),
        transfer::tests(),
        truth::tests(),
        viewports::tests(),
    ]
    .concat();
    let of_some_devices = [
        shadings::with_float_blending(),
        materials::with_timestamps(),
        mirror_images::with_timestamps(),
        recording::with_float_blending(),
        reflections::with_float_blending(),
        mirror_images::with_float_blending(),
    ];
    let of_any_device = of_any_device.into_iter().map(|test| (test, wgpu::Features::empty()));
    of_any_device.chain(of_some_devices.map(|(features, test)| (test, features))).collect()
}

/// Runs tests under a heading of their own.
fn run(
    arguments: &Arguments,
    prefix: &str,
    tests: Vec<(Test, Requirement)>,
    context: Option<&'static Context>,
) -> Conclusion {
    let trials = tests
        .into_iter()
        .map(|((name, test), features)| {
            let can_run = context.is_some_and(|c| c.gpu.device.features().contains(features));
            if context.is_some() && !can_run {
                eprintln!("{name} is ignored: the device lacks {features:?}");
            }
            let name = format!("{prefix}::{name}");
            Trial::test(name.clone(), move || {
                let context = context.filter(|_| can_run).ok_or("no adapter, or it lacks what is tested")?;
                let start = Instant::now();
                let result = std::panic::catch_unwind(AssertUnwindSafe(|| test(context)));
                TIMES.lock().unwrap().push((start.elapsed().as_secs_f32(), name));
                result.map_err(|payload| {
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
    libtest_mimic::run(arguments, trials)
}

fn main() {
    let mut arguments = Arguments::from_args();
    // The adapter uses all cores by itself, and memory for one atlas at a time.
    arguments.test_threads = Some(1);
    let gpu = match pollster::block_on(girandole::Gpu::new(None)) {
        Ok(gpu) => Some(gpu),
        Err(error) => {
            eprintln!("tests that need an adapter are ignored: {error}");
            None
        }
    };
    let context = |tier| -> Option<&'static Context> {
        gpu.clone().map(|gpu| &*Box::leak(Box::new(Context::new(gpu, tier))))
    };
    let functions = [mirrors::tests(), maps::tests(), selected::of_both_tiers()].concat();
    let functions = functions.into_iter().map(|test| (test, wgpu::Features::empty())).collect();
    let mut conclusions = vec![("functions", run(&arguments, "functions", functions, context(None)))];
    match std::env::var("GIRANDOLE_TEST_DEVICE") {
        Ok(name) => {
            // A few tests on a certain device: not to find it, or to run none of them, is a failure.
            let found = gpu.as_ref().map(|gpu| gpu.info.name.as_str()).unwrap_or_default();
            assert!(found.contains(&name), "the device is {found:?}, not {name}");
            let conclusion = run(&arguments, "device", pictures(), context(None));
            assert!(
                conclusion.num_passed + conclusion.num_failed > 0 || arguments.list,
                "no test is called so"
            );
            conclusions.push(("device", conclusion));
        }
        Err(_) => conclusions
            .extend(TIERS.map(|(name, tier)| (name, run(&arguments, name, pictures(), context(Some(tier)))))),
    }
    if !arguments.list {
        let mut times = TIMES.lock().unwrap();
        times.sort_by(|a, b| b.0.total_cmp(&a.0));
        for (seconds, name) in times.iter().take(SLOWEST) {
            println!("{seconds:6.1} s {name}");
        }
        for (name, c) in &conclusions {
            println!("{name}: {} passed, {} failed, {} ignored", c.num_passed, c.num_failed, c.num_ignored);
        }
    }
    if conclusions.iter().any(|(_, c)| c.has_failed()) {
        std::process::exit(101);
    }
}
