//! What was compiled for a device, and what is to be: kernels are made by threads of their own in the order in which they are asked for,
//! or by whoever needs one first.

#[cfg(feature = "parallel")]
use super::crew::Crew;
use super::kernel::{ComputeRecipe, RenderRecipe};
use super::module::LazyModule;
use crate::shaders::Source;
use crate::tier::Kernels;
use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use web_time::Instant;

/// How far the kernels are that frames were prepared to use.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Compilation {
    /// Kernels that were asked for so far.
    pub total: u32,
    /// How many of them are compiled.
    pub done: u32,
    /// How long recording waited for kernels so far, milliseconds; 0 in browsers.
    pub waited_ms: f64,
}

impl Compilation {
    /// Whether there is nothing left to compile.
    pub fn is_done(&self) -> bool {
        self.done == self.total
    }
}

/// A kernel that was compiled.
#[derive(Clone, Debug, PartialEq)]
pub struct CompiledKernel {
    /// The shader.
    pub shader: &'static str,
    /// Its entry points.
    pub entries: String,
    /// How long the device's library and driver took, milliseconds; 0 in browsers.
    pub ms: f64,
    /// Whether a frame waited for it, wholly or in part.
    pub was_waited_for: bool,
}

/// Modules and pipelines of a device. Whoever asks for one that is there gets that.
#[derive(Clone, Default)]
pub(crate) struct Compiled(Arc<Shop>);

#[derive(Default)]
struct Shop {
    memory: Mutex<Memory>,
    log: Arc<Mutex<Log>>,
    #[cfg(feature = "parallel")]
    crew: Crew,
}

#[derive(Default)]
pub(super) struct Memory {
    modules: HashMap<ModuleKey, Arc<LazyModule>>,
    pub kernels: HashMap<KernelKey, Arc<Lazy<ComputeRecipe>>>,
    pub render_kernels: HashMap<KernelKey, Arc<Lazy<RenderRecipe>>>,
}

#[derive(Default)]
struct Log {
    compilation: Compilation,
    kernels: Vec<CompiledKernel>,
}

/// Name, what it is put together from, variants.
pub(super) type ModuleKey = (&'static str, &'static [&'static str], Kernels);

#[derive(PartialEq, Eq, Hash)]
pub(super) struct KernelKey {
    module: ModuleKey,
    /// The entry point, or all that there is to a draw.
    entry: String,
    /// Overrides that the module declares, with their bits.
    constants: Vec<(String, u64)>,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Compiled {
    pub(super) fn module(&self, source: &Source, kernels: &Kernels) -> (ModuleKey, Arc<LazyModule>) {
        // What reads no hits, or shows no environment, is the same kernel for all.
        let mirrored = kernels.mirrored && source.uses.contains(&"hit");
        let reflects_environment = kernels.reflects_environment && source.uses.contains(&"reflection_beyond");
        let kernels = Kernels { mirrored, reflects_environment, ..*kernels };
        let key = (source.name, source.uses, kernels);
        let make = || Arc::new(LazyModule::new(source, &kernels));
        (key, locked(&self.0.memory).modules.entry(key).or_insert_with(make).clone())
    }

    /// What is found under a key in a part of the memory, or is to be made by this recipe.
    pub(super) fn get<R: Recipe>(
        &self,
        (module, entry, constants): (ModuleKey, String, &[(&str, f64)]),
        part: impl Fn(&mut Memory) -> &mut HashMap<KernelKey, Arc<Lazy<R>>>,
        recipe: impl FnOnce() -> R,
    ) -> Arc<Lazy<R>> {
        let constants = constants.iter().map(|(name, value)| (name.to_string(), value.to_bits())).collect();
        let key = KernelKey { module, entry, constants };
        let lazy = || Arc::new(Lazy::new(recipe(), self.0.log.clone()));
        part(&mut locked(&self.0.memory)).entry(key).or_insert_with(lazy).clone()
    }

    /// Has a kernel made soon, by the next thread that is free, unless it is there. Whether there is nothing to wait for.
    pub(super) fn order<R: Recipe>(&self, lazy: &Arc<Lazy<R>>) -> bool {
        #[cfg(feature = "parallel")]
        if lazy.made.get().is_none() && lazy.count() {
            R::send(lazy.clone(), &self.0.crew);
        }
        !cfg!(feature = "parallel") || lazy.made.get().is_some() || lazy.has_failed.load(Ordering::Relaxed)
    }

    pub fn compilation(&self) -> Compilation {
        locked(&self.0.log).compilation
    }

    pub fn kernels(&self) -> Vec<CompiledKernel> {
        locked(&self.0.log).kernels.clone()
    }
}

/// What a kernel is made by.
pub(super) trait Recipe: Sized {
    type Made;

    #[cfg(feature = "parallel")]
    fn device(&self) -> &wgpu::Device;

    /// Shader and entry points.
    fn names(&self) -> (&'static str, String);

    fn make(&self) -> Self::Made;

    /// Gives the work to a crew.
    #[cfg(feature = "parallel")]
    fn send(lazy: Arc<Lazy<Self>>, crew: &Crew);
}

/// A kernel that is made once, by a thread of the crew or by whoever needs it first.
pub(super) struct Lazy<R: Recipe> {
    recipe: R,
    made: OnceLock<R::Made>,
    making: Mutex<()>,
    is_counted: AtomicBool,
    /// Whether it could not be made ahead.
    has_failed: AtomicBool,
    log: Arc<Mutex<Log>>,
}

impl<R: Recipe> Lazy<R> {
    fn new(recipe: R, log: Arc<Mutex<Log>>) -> Self {
        let (made, making) = (OnceLock::new(), Mutex::default());
        let [is_counted, has_failed] = [false; 2].map(AtomicBool::new);
        Self { recipe, made, making, is_counted, has_failed, log }
    }

    pub fn recipe(&self) -> &R {
        &self.recipe
    }

    /// The kernel; made now, or waited for, where it is not there yet.
    pub fn get(&self) -> &R::Made {
        if let Some(made) = self.made.get() {
            return made;
        }
        self.count();
        let start = Instant::now();
        let _turn = locked(&self.making);
        let made = self.made.get_or_init(|| self.make());
        let mut log = locked(&self.log);
        log.compilation.waited_ms += milliseconds(start);
        let (shader, entries) = self.recipe.names();
        let mut last_first = log.kernels.iter_mut().rev();
        if let Some(kernel) = last_first.find(|k| k.shader == shader && k.entries == entries) {
            kernel.was_waited_for = true;
        }
        made
    }

    /// Makes it unless it is there. Where the device finds fault with it, it is left to those who need it, who are told then.
    #[cfg(feature = "parallel")]
    pub fn make_ahead(&self) {
        use std::task::{Context, Poll, Waker};
        let _turn = locked(&self.making);
        if self.made.get().is_some() {
            return;
        }
        let filters =
            [wgpu::ErrorFilter::Validation, wgpu::ErrorFilter::Internal, wgpu::ErrorFilter::OutOfMemory];
        let scopes = filters.map(|filter| self.recipe.device().push_error_scope(filter));
        let start = Instant::now();
        let made = self.recipe.make();
        let mut is_right = true;
        for scope in scopes.into_iter().rev() {
            // On native devices what is known of errors is known at once.
            let mut error = std::pin::pin!(scope.pop());
            if let Poll::Ready(Some(error)) = error.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
                tracing::debug!("{error}");
                is_right = false;
            }
        }
        if is_right && self.made.set(made).is_ok() {
            self.note(milliseconds(start));
        } else if self.is_counted.swap(false, Ordering::Relaxed) {
            self.has_failed.store(true, Ordering::Relaxed);
            locked(&self.log).compilation.total -= 1;
        }
    }

    fn make(&self) -> R::Made {
        let start = Instant::now();
        let made = self.recipe.make();
        self.note(milliseconds(start));
        made
    }

    /// Counts it among those that were asked for; whether it was not before.
    fn count(&self) -> bool {
        let is_new = !self.is_counted.swap(true, Ordering::Relaxed);
        if is_new {
            locked(&self.log).compilation.total += 1;
        }
        is_new
    }

    fn note(&self, ms: f64) {
        let (shader, entries) = self.recipe.names();
        let mut log = locked(&self.log);
        log.compilation.done += 1;
        log.kernels.push(CompiledKernel { shader, entries, ms, was_waited_for: false });
    }
}

fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
