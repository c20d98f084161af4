//! The call of the program that has given options: the way back from [`RenderArgs`] to a command line.

use super::{LightArgs, MotionArgs, QualityArgs, RenderArgs, SceneArgs, ToneCurve, ViewArgs, parse};
use anyhow::{Context, Result};
use clap::ValueEnum;
use girandole_core::lights::LightSettings;
use girandole_core::tonemap::Exposure;
use std::path::Path;

/// An option's name, and its value if there is one.
pub type Choice = (&'static str, Option<String>);

impl ViewArgs {
    /// Those of `girandole view` without options.
    pub fn defaults() -> Result<Self> {
        Ok(parse("view", &[])?)
    }
}

impl RenderArgs {
    /// Those of `girandole render` without options.
    pub fn defaults() -> Result<Self> {
        Ok(parse("render", &[])?)
    }

    /// How light is sampled: edits may have switched all of it off.
    pub fn light_settings(&self) -> LightSettings {
        LightSettings { dark: self.seen.edits.is_some(), ..self.lights.settings() }
    }

    /// The call of `girandole render` that has these options, quoted for a POSIX shell. Those that are as without options are
    /// left out.
    ///
    /// # Errors
    /// Where a file's name is no Unicode, or holds a zero byte.
    pub fn command_line(&self) -> Result<String> {
        let defaults = Self::defaults()?;
        let mut words: Vec<String> = ["girandole", "render"].map(String::from).into();
        let is_default = self.scene == defaults.scene;
        let looks_like_an_option = self.scene.starts_with('-');
        if !is_default && !looks_like_an_option {
            words.push(self.scene.clone());
        }
        for ((name, value), (_, default)) in self.choices()?.into_iter().zip(defaults.choices()?) {
            match value.filter(|value| default.as_ref() != Some(value)) {
                Some(value) if value.starts_with('-') => words.push(format!("{name}={value}")),
                Some(value) => words.extend([name.into(), value]),
                None => {}
            }
        }
        if self.motion.overwrite {
            words.push("--overwrite".into());
        }
        if !is_default && looks_like_an_option {
            words.extend(["--".into(), self.scene.clone()]);
        }
        Ok(shlex::try_join(words.iter().map(String::as_str))?)
    }

    /// All options that have values in the order of the help text; the scene is none.
    pub fn choices(&self) -> Result<Vec<Choice>> {
        let Self {
            scene: _, output, size, camera, object, seen, motion, piece, lights, mode, quality, ..
        } = self;
        let Self { debug, engine, paths, adapter, exposure, tonemap, aa, refine, stats, .. } = self;
        let SceneArgs { view, edits, load } = seen;
        let mut choices = vec![
            ("--output", Some(file_name(output)?)),
            ("--size", text(format!("{}x{}", size[0], size[1]))),
            ("--camera", camera.clone()),
            ("--view", view.map(|view| view.to_string())),
            ("--edits", edits.as_deref().map(file_name).transpose()?),
            ("--object", object.clone()),
        ];
        choices.extend(load.choices()?);
        choices.extend(motion.choices());
        choices.extend(piece.choices());
        choices.extend(self.transfer.choices());
        choices.extend(lights.choices());
        choices.push(("--mode", value_name(mode)));
        choices.extend(quality.choices());
        choices.extend([
            ("--debug", debug.map(|view| view.to_string())),
            ("--engine", value_name(engine)),
            ("--paths", text(paths)),
            ("--adapter", adapter.clone()),
        ]);
        choices.extend(shown(*exposure, tonemap));
        choices.extend([
            ("--aa", aa.as_ref().and_then(value_name)),
            ("--refine", text(refine)),
            ("--stats", stats.as_deref().map(file_name).transpose()?),
        ]);
        Ok(choices)
    }
}

impl MotionArgs {
    fn choices(&self) -> [Choice; 7] {
        let Self { time, frames, overwrite: _, fps, rewalk, fade, updates, max_map_age } = self;
        [
            ("--time", time.map(|seconds| seconds.to_string())),
            ("--frames", frames.map(|frames| frames.to_string())),
            ("--fps", text(fps)),
            ("--rewalk", text(rewalk)),
            ("--fade", text(fade)),
            ("--updates", text(updates)),
            ("--max-map-age", max_map_age.map(|frames| frames.to_string())),
        ]
    }
}

impl LightArgs {
    fn choices(&self) -> [Choice; 6] {
        let Self { lights, direct, placement, bounces, seed, termination } = self;
        [
            ("--lights", text(lights)),
            ("--direct", text(direct)),
            ("--placement", value_name(placement)),
            ("--bounces", text(bounces)),
            ("--seed", text(seed)),
            ("--termination", value_name(termination)),
        ]
    }
}

impl QualityArgs {
    fn choices(&self) -> [Choice; 10] {
        let Self { clamp, shadow_map, map_size, pcf, memory, light_maps, shading, .. } = self;
        let Self { lights_per_pass, tolerance, mirrors, .. } = self;
        [
            ("--clamp", text(clamp)),
            ("--shadow-map", value_name(shadow_map)),
            ("--map-size", map_size.map(|texels| texels.to_string())),
            ("--pcf", text(pcf)),
            ("--memory", text(memory)),
            ("--light-maps", light_maps.as_ref().and_then(value_name)),
            ("--shading", value_name(shading)),
            ("--lights-per-pass", text(lights_per_pass)),
            ("--tolerance", text(tolerance)),
            ("--mirrors", text(mirrors)),
        ]
    }
}

/// How a picture is shown, by option.
pub fn shown(exposure: Exposure, tonemap: &ToneCurve) -> [Choice; 2] {
    [("--exposure", stops(exposure)), ("--tonemap", value_name(tonemap))]
}

fn stops(exposure: Exposure) -> Option<String> {
    match exposure {
        Exposure::Auto => text("auto"),
        Exposure::Ev(ev) => text(ev),
    }
}

pub(super) fn text(value: impl ToString) -> Option<String> {
    Some(value.to_string())
}

pub(super) fn value_name(value: &impl ValueEnum) -> Option<String> {
    Some(value.to_possible_value()?.get_name().to_owned())
}

pub(super) fn file_name(path: &Path) -> Result<String> {
    let name =
        path.to_str().with_context(|| format!("{} is no Unicode; give it another name", path.display()))?;
    Ok(name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::super::{Cli, Command};
    use super::*;
    use anyhow::bail;
    use clap::{CommandFactory, Parser};
    use proptest::prelude::*;
    use proptest::sample::{select, subsequence};

    fn called(words: &[String]) -> Result<RenderArgs> {
        match Cli::try_parse_from(words)?.command {
            Some(Command::Render(args)) => Ok(*args),
            other => bail!("{words:?} is {other:?}"),
        }
    }

    /// Options with other values than their own.
    const OPTIONS: [(&str, &[&str]); 39] = [
        ("--region", &["0,0,1,1", "8191,5,1,3"]),
        ("--sets", &["0..0", "3..17"]),
        ("--size", &["8x6", "8192x1"]),
        ("--lights", &["1", "1048576"]),
        ("--direct", &["0", "0.1", "1"]),
        ("--placement", &["scene"]),
        ("--bounces", &["0", "1000", "unlimited"]),
        ("--seed", &["1", "4294967295"]),
        ("--termination", &["throughput"]),
        ("--mode", &["vd-lp", "vd", "naive"]),
        ("--clamp", &["off", "0.3", "1e-30"]),
        ("--shadow-map", &["parabolic", "cube"]),
        ("--map-size", &["16", "8192"]),
        ("--pcf", &["1", "16"]),
        ("--memory", &["1", "1000"]),
        ("--light-maps", &["on", "off"]),
        ("--shading", &["multipass"]),
        ("--lights-per-pass", &["1", "32"]),
        ("--tolerance", &["0", "0.123456789", "1"]),
        ("--mirrors", &["1", "16"]),
        ("--debug", &["receivers", "states", "states:7", "light-maps", "levels", "lights", "atlas"]),
        ("--engine", &["gpu", "cpu", "path"]),
        ("--paths", &["1", "1000000"]),
        ("--exposure", &["-1.5", "0", "64"]),
        ("--tonemap", &["aces", "none"]),
        ("--aa", &["2", "4"]),
        ("--refine", &["2", "1000000"]),
        ("--adapter", &["lava pipe", "-1", "--help"]),
        ("--object", &["none", "torus", "-x.ply", "two words.obj"]),
        ("--transfer", &["centre", "grid"]),
        ("--transfer-nodes", &["Bunny", "a b,-c,$d"]),
        ("--transfer-points", &["1", "16"]),
        ("--transfer-bands", &["1", "8"]),
        ("--transfer-rays", &["64", "65536"]),
        ("--transfer-bounces", &["0", "64"]),
        ("--transfer-clusters", &["0", "32"]),
        ("--transfer-bases", &["0", "16"]),
        ("--edits", &["e.json", "-e.json", "it's.json"]),
        ("--stats", &["s.json", "$(s).json"]),
    ];
    const CAMERAS: [(&str, &[&str]); 2] = [
        ("--camera", &["1", "-1", "", "Front \"door\""]),
        ("--view", &["0,1.7,4,0,1.7,0,0,1,0,60", "-0,1e-7,1e14,-3,0.1,0.2,0,1,0,2.5m"]),
    ];
    const AROUND: [(&str, &[&str]); 8] = [
        ("--environment", &["sky.hdr", "two skies.exr", "0.1,2,1e3", "sky", "sky:12.5", "sky:90,-30.25,1"]),
        ("--environment-strength", &["0", "0.3", "1e6"]),
        ("--environment-rotation", &["-90.5", "0", "400"]),
        ("--scale", &["0.01", "1e3"]),
        ("--clip", &["0", "Walk fast"]),
        ("--up", &["x", "y", "z"]),
        ("--background", &["transparent"]),
        ("--light", &["none", "studio"]),
    ];
    const MOTION: [(&str, &[&str]); 6] = [
        ("--part", &["1/1", "3/8"]),
        ("--fps", &["24", "29.97"]),
        ("--rewalk", &["1", "200", "all"]),
        ("--fade", &["0", "1000"]),
        ("--updates", &["0", "100", "7.5ms"]),
        ("--max-map-age", &["0", "9"]),
    ];

    /// Some of the options, each with one of its values.
    fn some(options: &'static [(&str, &[&str])]) -> impl Strategy<Value = Vec<String>> {
        let word = |&(name, values): &(&'static str, &'static [&'static str])| {
            select(values).prop_map(move |value| format!("{name}={value}"))
        };
        subsequence(options, 0..=options.len()).prop_flat_map(move |o| o.iter().map(word).collect::<Vec<_>>())
    }

    fn motion() -> impl Strategy<Value = Vec<String>> {
        prop_oneof![
            Just(Vec::new()),
            Just(vec!["--time=2.125".to_owned()]),
            some(&MOTION).prop_map(|mut words| {
                let needs_updates = !words.iter().any(|w| w.starts_with("--updates"));
                words.retain(|w| !(needs_updates && w.starts_with("--max-map-age")));
                words.extend(["--frames=3..17".into(), "--overwrite".into()]);
                words
            }),
        ]
    }

    fn load() -> impl Strategy<Value = Vec<String>> {
        prop_oneof![
            some(&AROUND[3..]),
            some(&AROUND[..3]).prop_map(|mut words| {
                if !words.iter().any(|w| w.starts_with("--environment=")) {
                    words.clear();
                }
                words
            }),
        ]
    }

    fn any_name() -> impl Strategy<Value = String> {
        prop_oneof!["[^\0]{1,12}", "[-'\" \\\\$`!*~#\n=äλ]{1,6}"]
    }

    proptest! {
        #[test]
        fn what_is_printed_is_parsed_to_the_same(
            options in some(&OPTIONS),
            camera in (0..CAMERAS.len()).prop_flat_map(|i| some(&CAMERAS[i..=i])),
            motion in motion(),
            load in load(),
            names in (any_name(), any_name()),
        ) {
            let (scene, output) = names;
            let mut words = vec!["girandole".to_owned(), "render".into(), format!("--output={output}")];
            words.extend(options.into_iter().chain(camera).chain(motion).chain(load));
            words.extend(["--".into(), scene]);
            let args = called(&words).map_err(|e| TestCaseError::fail(e.to_string()))?;
            let line = args.command_line().map_err(|e| TestCaseError::fail(e.to_string()))?;
            let split = shlex::split(&line).ok_or_else(|| TestCaseError::fail("not quoted"))?;
            let again = called(&split).map_err(|e| TestCaseError::fail(format!("{line}: {e}")))?;
            prop_assert_eq!(args, again, "{}", line);
            prop_assert!(split.len() <= 2 * words.len());
        }
    }

    #[test]
    fn only_what_differs_is_printed() -> Result<()> {
        let mut args = RenderArgs::defaults()?;
        assert_eq!(args.command_line()?, "girandole render");
        args.scene = "-it's a room.glb".into();
        args.exposure = Exposure::Ev(-1.5);
        args.lights.lights = 1024;
        let expected = r#"girandole render --lights 1024 '--exposure=-1.5' -- "-it's a room.glb""#;
        assert_eq!(args.command_line()?, expected);
        args.output = "a\0b.png".into();
        assert!(args.command_line().is_err());
        Ok(())
    }

    #[test]
    fn no_option_is_forgotten() -> Result<()> {
        let printed: Vec<&str> = RenderArgs::defaults()?.choices()?.iter().map(|(name, _)| *name).collect();
        let cli = Cli::command();
        let render = cli.find_subcommand("render").context("render")?;
        let known: Vec<String> =
            render.get_arguments().filter_map(|a| Some(format!("--{}", a.get_long()?))).collect();
        for option in known.iter().filter(|o| !["--help", "--overwrite"].contains(&o.as_str())) {
            assert!(printed.contains(&option.as_str()), "{option}");
        }
        let tested: Vec<&str> =
            [&OPTIONS[..], &CAMERAS, &MOTION, &AROUND].concat().iter().map(|o| o.0).collect();
        for option in printed {
            let elsewhere = ["--output", "--time", "--frames"].contains(&option);
            assert!(tested.contains(&option) || elsewhere, "{option} is not tested");
        }
        Ok(())
    }
}
