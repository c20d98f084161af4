//! Values of options: their names on the command line, and their ranges.

use clap::ValueEnum;
use girandole_core::lights;
use girandole_core::scene::View;
use girandole_core::tonemap::{Exposure, Tonemap};

/// The engine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Engine {
    /// gpu where there is an adapter, else cpu
    #[default]
    Auto,
    /// Shadow maps on a graphics adapter
    Gpu,
    /// The same light samples with traced shadows
    Cpu,
    /// The path tracer
    Path,
}

/// How random walks end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum TerminationArg {
    /// Never early: samples grow weaker with every bounce
    Throughput,
    /// By Russian roulette at every hit: samples of even strength
    #[default]
    Albedo,
}

/// The parameterisation of shadow maps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ShadowMap {
    /// Four faces of an octahedron unfolded to a square
    #[default]
    Octahedral,
    /// Brabec 2002
    Parabolic,
    /// Five faces of a cube
    Cube,
}

/// How much work is avoided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Mode {
    /// Visibility determination, light maps, low resolution where that is enough
    #[default]
    Full,
    /// Visibility determination, and low resolution where that is enough
    VdLp,
    /// Visibility determination: shadow maps are read only where something may block the light
    Vd,
    /// Every light, every shadow map, at every pixel
    Naive,
}

impl Mode {
    /// As in `--mode`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::VdLp => "vd-lp",
            Self::Vd => "vd",
            Self::Naive => "naive",
        }
    }
}

/// How points are shaded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ShadingArg {
    /// In one dispatch, each point walks the lights of its receiver
    #[default]
    Fused,
    /// A few lights a pass, added by blending; mode full optimises the passes
    Multipass,
}

/// On or off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Switch {
    /// Yes
    On,
    /// No
    Off,
}

/// The tone curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ToneCurve {
    /// AgX: soft
    #[default]
    Agx,
    /// ACES: contrasty
    Aces,
    /// Cut off at 1
    None,
}

impl From<ToneCurve> for Tonemap {
    fn from(curve: ToneCurve) -> Self {
        match curve {
            ToneCurve::Agx => Self::Agx,
            ToneCurve::Aces => Self::Aces,
            ToneCurve::None => Self::None,
        }
    }
}

/// Samples along each axis of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum AntiAliasing {
    /// One sample in the middle of a pixel
    #[default]
    Off,
    /// 2 × 2 samples
    #[value(name = "2")]
    Two,
    /// 4 × 4 samples
    #[value(name = "4")]
    Four,
}

impl AntiAliasing {
    /// As a number.
    pub fn samples_per_axis(self) -> u32 {
        match self {
            Self::Off => 1,
            Self::Two => 2,
            Self::Four => 4,
        }
    }
}

/// A limit on bounces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bounces {
    /// At most so many.
    Limit(u32),
    /// No limit.
    Unlimited,
}

impl Bounces {
    /// The limit, if there is one.
    pub fn limit(self) -> Option<u32> {
        match self {
            Self::Limit(n) => Some(n),
            Self::Unlimited => None,
        }
    }
}

impl std::fmt::Display for Bounces {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::Limit(n) => write!(f, "{n}"),
            Self::Unlimited => f.write_str("unlimited"),
        }
    }
}

/// Percentage-closer filtering: width in texels, 0 = off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pcf(pub u32);

impl std::fmt::Display for Pcf {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self.0 {
            0 => f.write_str("off"),
            texels => write!(f, "{texels}"),
        }
    }
}

/// The bound on the geometric factor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Clamp(pub lights::Clamp);

impl std::fmt::Display for Clamp {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self.0 {
            lights::Clamp::Own => f.write_str("auto"),
            lights::Clamp::Off => f.write_str("off"),
            lights::Clamp::At(bound) => write!(f, "{bound}"),
        }
    }
}

/// The share of samples on emitters; none = as the light demands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DirectShare(pub Option<f32>);

impl std::fmt::Display for DirectShare {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self.0 {
            Some(share) => write!(f, "{share}"),
            None => f.write_str("auto"),
        }
    }
}

/// Where light samples are placed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Placement {
    /// Where they matter to what the camera sees
    #[default]
    View,
    /// By power, wherever the camera is
    Scene,
}

impl Placement {
    /// Those of the views that samples are placed for.
    pub fn views(self, views: &[View]) -> &[View] {
        match self {
            Self::View => views,
            Self::Scene => &[],
        }
    }
}

/// A debug view instead of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DebugView {
    /// Leaf receivers.
    Receivers,
    /// States of one light, or the number of partially occluded lights.
    States(Option<u32>),
    /// Light maps.
    LightMaps,
    /// Where points were shaded.
    Levels,
    /// Light markers.
    Lights,
    /// Shadow maps.
    Atlas,
}

impl From<DebugView> for girandole::DebugView {
    fn from(view: DebugView) -> Self {
        match view {
            DebugView::Receivers => Self::Receivers,
            DebugView::States(light) => Self::States(light),
            DebugView::LightMaps => Self::LightMaps,
            DebugView::Levels => Self::Levels,
            DebugView::Lights => Self::LightPositions,
            DebugView::Atlas => Self::Atlas,
        }
    }
}

impl std::fmt::Display for DebugView {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(match self {
            Self::Receivers => "receivers",
            Self::States(None) => "states",
            Self::States(Some(light)) => return write!(f, "states:{light}"),
            Self::LightMaps => "light-maps",
            Self::Levels => "levels",
            Self::Lights => "lights",
            Self::Atlas => "atlas",
        })
    }
}

type Parsed<T> = Result<T, String>;

pub(super) fn parse_size(text: &str) -> Parsed<[u32; 2]> {
    parse_sides(text, 8192)
}

/// Sides of pictures that may be drawn window by window.
pub(super) fn parse_picture_size(text: &str) -> Parsed<[u32; 2]> {
    parse_sides(text, 65_536)
}

fn parse_sides(text: &str, most: u32) -> Parsed<[u32; 2]> {
    let sides = text.split_once(['x', 'X', '×']).and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    match sides {
        Some(size) if size.iter().all(|side| (1..=most).contains(side)) => Ok(size),
        Some(_) => Err(format!("each side must be from 1 to {most} pixels")),
        None => Err("give width and height in pixels as in 1024x768".into()),
    }
}

pub(super) fn parse_finite(text: &str) -> Parsed<f32> {
    text.parse::<f32>().ok().filter(|x| x.is_finite()).ok_or_else(|| "give a number".into())
}

pub(super) fn parse_share(text: &str) -> Parsed<f32> {
    parse_finite(text)
        .ok()
        .filter(|x| (0.0..=1.0).contains(x))
        .ok_or_else(|| "give a number from 0 to 1".into())
}

pub(super) fn parse_direct(text: &str) -> Parsed<DirectShare> {
    match text {
        "auto" => Ok(DirectShare(None)),
        _ => parse_share(text)
            .map(|share| DirectShare(Some(share)))
            .map_err(|_| "give a number from 0 to 1, or auto".into()),
    }
}

pub(super) fn parse_trim(text: &str) -> Parsed<f32> {
    parse_share(text).ok().filter(|&x| x < 1.0).ok_or_else(|| "give a number from 0 to less than 1".into())
}

pub(super) fn parse_threshold(text: &str) -> Parsed<f64> {
    text.parse::<f64>()
        .ok()
        .filter(|x| x.is_finite() && *x >= 0.0)
        .ok_or_else(|| "give a number that is not negative".into())
}

pub(super) fn parse_bounces(text: &str) -> Parsed<Bounces> {
    match text {
        "unlimited" => Ok(Bounces::Unlimited),
        _ => text
            .parse()
            .ok()
            .filter(|n| *n <= 1000)
            .map(Bounces::Limit)
            .ok_or_else(|| "give a whole number from 0 to 1000, or unlimited".into()),
    }
}

pub(super) fn parse_clamp(text: &str) -> Parsed<Clamp> {
    match text {
        "auto" => Ok(Clamp(lights::Clamp::Own)),
        "off" => Ok(Clamp(lights::Clamp::Off)),
        _ => parse_finite(text)
            .ok()
            .filter(|&x| x > 0.0)
            .map(|bound| Clamp(lights::Clamp::At(bound)))
            .ok_or_else(|| "give a positive number of 1/m², auto or off".into()),
    }
}

pub(super) fn parse_debug(text: &str) -> Parsed<DebugView> {
    Ok(match text {
        "receivers" => DebugView::Receivers,
        "states" => DebugView::States(None),
        "light-maps" => DebugView::LightMaps,
        "levels" => DebugView::Levels,
        "lights" => DebugView::Lights,
        "atlas" => DebugView::Atlas,
        _ => {
            let light = text.strip_prefix("states:").and_then(|n| n.parse().ok());
            DebugView::States(Some(
                light.ok_or("give receivers, states, states:N, light-maps, levels, lights or atlas")?,
            ))
        }
    })
}

pub(super) fn parse_pcf(text: &str) -> Parsed<Pcf> {
    match text {
        "off" => Ok(Pcf(0)),
        _ => text
            .parse()
            .ok()
            .filter(|n| (1..=16).contains(n))
            .map(Pcf)
            .ok_or_else(|| "give a whole number from 1 to 16, or off".into()),
    }
}

pub(super) fn parse_budget(text: &str) -> Parsed<f64> {
    if text == "any" {
        return Ok(f64::INFINITY);
    }
    let milliseconds = parse_finite(text).ok().map(f64::from);
    milliseconds
        .filter(|ms| (1.0..=1e4).contains(ms))
        .ok_or_else(|| "give milliseconds from 1 to 10000, or any".into())
}

pub(super) fn parse_exposure(text: &str) -> Parsed<Exposure> {
    match text {
        "auto" => Ok(Exposure::Auto),
        _ => parse_finite(text)
            .ok()
            .filter(|ev| ev.abs() <= 64.0)
            .map(Exposure::Ev)
            .ok_or_else(|| "give stops from -64 to 64, or auto".into()),
    }
}
