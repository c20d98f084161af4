//! Options of what is seen of a scene, and of what was changed in it.

use super::command_line::{Choice, file_name, value_name};
use super::values::parse_finite;
use clap::{Args, ValueEnum};
use girandole_core::glam::DVec3;
use girandole_core::scene::{ClipPlanes, DefaultLight, FieldOfView, Sky, UpAxis, Viewpoint};
use std::path::PathBuf;

/// Options of the view and of edits.
#[derive(Args, Clone, Debug, Default, PartialEq)]
pub struct SceneArgs {
    /// A camera by numbers: where it is, what it looks at and what is up (x, y and z of each, world metres, +Y up), then the
    /// vertical angle of view in degrees; or, with an m after it, the height in metres of a parallel projection. With ,near=1.2
    /// or ,far=50 after that, what is nearer or farther than so many metres is not drawn. Mirrored and off-axis views cannot be
    /// given in this way
    #[arg(long, value_name = "EYE,TARGET,UP,FOV", value_parser = parse_view, allow_hyphen_values = true)]
    pub view: Option<ViewArg>,

    /// What was moved, lit, added and removed, as the library's `Edits` write it; done once the scene is loaded, before
    /// --time and --frames. Models that it names are looked for in its folder
    #[arg(long, value_name = "FILE.json")]
    pub edits: Option<PathBuf>,

    #[command(flatten)]
    pub load: LoadArgs,
}

impl SceneArgs {
    /// Names its files whatever the current folder is.
    pub fn make_absolute(&mut self) -> std::io::Result<()> {
        if let Some(file) = &mut self.edits {
            *file = std::path::absolute(&*file)?;
        }
        if let Some(EnvironmentArg::File(file)) = &mut self.load.environment {
            *file = std::path::absolute(&*file)?;
        }
        Ok(())
    }
}

/// Options of how a scene is loaded.
#[derive(Args, Clone, Debug, Default, PartialEq)]
pub struct LoadArgs {
    /// Light from all around, infinitely far away, which is also seen behind the scene: a picture of all directions, .exr or .hdr,
    /// twice as wide as high (its middle is towards −Z); sky, or sky:ELEVATION,AZIMUTH,TURBIDITY: a clear sky with its sun, that stands
    /// so high and so far clockwise from −Z (degrees; sky:40,225,3 if not given), in units of 683 cd/m²; or the same radiance from
    /// everywhere, W/(sr·m²)
    #[arg(long, value_name = "FILE.{exr,hdr}|sky[:E,A,T]|R,G,B")]
    pub environment: Option<EnvironmentArg>,

    /// What the environment is multiplied by, from 0 to 1e6; 1 if not given
    #[arg(long, value_name = "FACTOR", requires = "environment", value_parser = parse_strength)]
    pub environment_strength: Option<f32>,

    /// How far the environment is turned, degrees, counter-clockwise seen from above; 0 if not given
    #[arg(long, value_name = "DEGREES", requires = "environment", value_parser = parse_finite, allow_hyphen_values = true)]
    pub environment_rotation: Option<f32>,

    /// What is seen where no surface is
    #[arg(long, value_enum, default_value_t)]
    pub background: BackgroundArg,

    /// What else lights a scene that comes from a file
    #[arg(long, value_enum, default_value_t = LightArg::Auto, conflicts_with = "environment")]
    pub light: LightArg,

    /// What all lengths of a file are multiplied by, for files in other units than metres: 0.01 for centimetres
    #[arg(long, value_name = "FACTOR", value_parser = parse_scale)]
    pub scale: Option<f64>,

    /// The animation of a file that plays, by name or number from 0, and no other. Without it the first plays, and with it those that
    /// drive other things
    #[arg(long, value_name = "NAME|INDEX")]
    pub clip: Option<String>,

    /// Which axis of a file points up, that of the scene or of --object: z for most drawings of buildings and
    /// machines. If not given, y; models that seem to lie on their side are named in a warning
    #[arg(long, value_enum, value_name = "AXIS")]
    pub up: Option<UpArg>,
}

/// Which axis of a file points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum UpArg {
    /// +X
    X,
    /// +Y, as in glTF files
    Y,
    /// +Z
    Z,
}

impl From<UpArg> for UpAxis {
    fn from(up: UpArg) -> Self {
        match up {
            UpArg::X => Self::X,
            UpArg::Y => Self::Y,
            UpArg::Z => Self::Z,
        }
    }
}

/// What is seen where no surface is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum BackgroundArg {
    /// The environment, or black
    #[default]
    Environment,
    /// Nothing: pictures have alpha (in .exr files, radiance is multiplied by it; in .png files, colours are not). The environment
    /// lights the scene all the same
    Transparent,
}

/// What lights a scene beside its own light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum LightArg {
    /// A studio where the file's own light reaches less than half of what its first camera sees; in closed rooms a lamp under the
    /// ceiling. What has no floor of its own stands on a ground there, but before a transparent background
    #[default]
    Auto,
    /// Nothing
    None,
    /// A photographer's studio: a grey dome, a key light above the camera to the left, a weak one to the right, and a ground as with auto
    Studio,
}

impl From<LightArg> for DefaultLight {
    fn from(light: LightArg) -> Self {
        match light {
            LightArg::Auto => Self::Auto,
            LightArg::None => Self::None,
            LightArg::Studio => Self::Studio,
        }
    }
}

/// What is all around.
#[derive(Clone, Debug, PartialEq)]
pub enum EnvironmentArg {
    /// The same radiance from everywhere.
    Color([f32; 3]),
    /// A picture of all directions.
    File(PathBuf),
    /// A clear sky with its sun: elevation and azimuth in degrees, turbidity.
    Sky([f32; 3]),
}

impl std::str::FromStr for EnvironmentArg {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let path = PathBuf::from(text);
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr") || e.eq_ignore_ascii_case("hdr")) {
            return Ok(Self::File(path));
        }
        if let Some(rest) = text.strip_prefix("sky") {
            return parse_sky(rest).map(Self::Sky);
        }
        let wrong = || "give an .exr or .hdr file, sky, or three numbers as in 0.5,0.8,1.5".to_owned();
        let number = |text: &str| text.trim().parse::<f32>().ok().filter(|x| x.is_finite() && *x >= 0.0);
        let numbers = text.split(',').map(number).collect::<Option<Vec<f32>>>().ok_or_else(wrong)?;
        Ok(Self::Color(numbers.try_into().map_err(|_| wrong())?))
    }
}

/// What follows `sky`: up to three numbers, those that are left out as [`Sky::default`] has them.
fn parse_sky(text: &str) -> Result<[f32; 3], String> {
    let Sky { elevation, azimuth, turbidity } = Sky::default();
    let mut numbers = [elevation.to_degrees().round(), azimuth.to_degrees().round(), turbidity];
    let wrong = || {
        "give the sun's elevation (0 to 90°), its azimuth (degrees) and the turbidity (1 to 10), as in sky:30,225,3".to_owned()
    };
    if text.is_empty() {
        return Ok(numbers);
    }
    let given = text.strip_prefix(':').ok_or_else(wrong)?;
    for (i, word) in given.split(',').enumerate() {
        *numbers.get_mut(i).ok_or_else(wrong)? = parse_finite(word.trim()).map_err(|_| wrong())?;
    }
    let in_range = (0.0..=90.0).contains(&numbers[0]) && (1.0..=10.0).contains(&numbers[2]);
    if in_range { Ok(numbers) } else { Err(wrong()) }
}

impl LoadArgs {
    /// The options' words on a command line.
    pub(super) fn choices(&self) -> anyhow::Result<[Choice; 8]> {
        let Self {
            environment,
            environment_strength,
            environment_rotation,
            background,
            light,
            scale,
            clip,
            up,
        } = self;
        let environment = match environment {
            Some(EnvironmentArg::Color([r, g, b])) => Some(format!("{r:?},{g:?},{b:?}")),
            Some(EnvironmentArg::File(path)) => Some(file_name(path)?),
            Some(EnvironmentArg::Sky([elevation, azimuth, turbidity])) => {
                Some(format!("sky:{elevation:?},{azimuth:?},{turbidity:?}"))
            }
            None => None,
        };
        Ok([
            ("--environment", environment),
            ("--environment-strength", environment_strength.map(|x| format!("{x:?}"))),
            ("--environment-rotation", environment_rotation.map(|x| format!("{x:?}"))),
            ("--background", value_name(background)),
            ("--light", value_name(light)),
            ("--scale", scale.map(|x| format!("{x:?}"))),
            ("--clip", clip.clone()),
            ("--up", up.as_ref().and_then(value_name)),
        ])
    }
}

fn parse_scale(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok();
    number.filter(|x| (1e-12..=1e12).contains(x)).ok_or_else(|| "give a factor from 1e-12 to 1e12".into())
}

fn parse_strength(text: &str) -> Result<f32, String> {
    parse_finite(text)
        .ok()
        .filter(|x| (0.0..=1e6).contains(x))
        .ok_or_else(|| "give a factor from 0 to 1000000".into())
}

/// A camera by numbers, that has a view. It is printed and parsed without loss.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewArg(pub Viewpoint);

impl From<Viewpoint> for ViewArg {
    fn from(viewpoint: Viewpoint) -> Self {
        Self(viewpoint)
    }
}

impl std::fmt::Display for ViewArg {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let Viewpoint { eye, target, up, field, clip } = self.0;
        for value in [eye, target, up].iter().flat_map(DVec3::to_array) {
            write!(f, "{},", shortest(value))?;
        }
        match field {
            FieldOfView::Perspective { degrees } => f.write_str(&shortest(degrees))?,
            FieldOfView::Orthographic { height } => write!(f, "{}m", shortest(height))?,
        }
        let ClipPlanes { near, far } = clip;
        if near > 0.0 {
            write!(f, ",near={near}")?;
        }
        if far.is_finite() { write!(f, ",far={far}") } else { Ok(()) }
    }
}

/// The fewest digits that are parsed to the same bits.
fn shortest(value: f64) -> String {
    let text = format!("{value:?}");
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}

fn parse_view(text: &str) -> Result<ViewArg, String> {
    let wrong = || "give ten numbers as in 0,1.7,4,0,1.7,0,0,1,0,60: eye, target, up, degrees".to_owned();
    let mut clip = ClipPlanes::NONE;
    let mut text = text;
    for (name, plane) in [("far=", &mut clip.far), ("near=", &mut clip.near)] {
        if let Some((rest, last)) = text.rsplit_once(',')
            && let Some(distance) = last.trim().strip_prefix(name)
        {
            *plane = distance.parse().map_err(|_| format!("give metres after {name}, as in {name}1.5"))?;
            text = rest;
        }
    }
    let (points, field) = text.rsplit_once(',').ok_or_else(wrong)?;
    let number = |text: &str| text.trim().parse::<f64>().map_err(|_| wrong());
    let points: Vec<f64> = points.split(',').map(number).collect::<Result<_, _>>()?;
    let [x, y, z, to_x, to_y, to_z, up_x, up_y, up_z] = points[..] else { return Err(wrong()) };
    let viewpoint = Viewpoint {
        eye: DVec3::new(x, y, z),
        target: DVec3::new(to_x, to_y, to_z),
        up: DVec3::new(up_x, up_y, up_z),
        field: match field.strip_suffix('m') {
            Some(height) => FieldOfView::Orthographic { height: number(height)? },
            None => FieldOfView::Perspective { degrees: number(field)? },
        },
        clip,
    };
    viewpoint.view(1.0).map_err(|error| error.to_string())?;
    Ok(ViewArg(viewpoint))
}

#[cfg(test)]
mod tests {
    use super::*;
    use girandole_core::scene::builtin;
    use proptest::prelude::*;

    fn number() -> impl Strategy<Value = f64> {
        prop_oneof![-1e15..1e15, -10.0..10.0, -1e-9..1e-9, any::<i16>().prop_map(f64::from)]
    }

    fn point() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(number()).prop_map(DVec3::from)
    }

    fn field() -> impl Strategy<Value = FieldOfView> {
        prop_oneof![
            (1e-6..179.999).prop_map(|degrees| FieldOfView::Perspective { degrees }),
            (1e-30..1e14).prop_map(|height| FieldOfView::Orthographic { height }),
        ]
    }

    fn clip() -> impl Strategy<Value = ClipPlanes> {
        let plane = || prop_oneof![Just(0.0_f32), 1e-9..1e9_f32];
        (plane(), prop_oneof![Just(f32::INFINITY), 1e-9..1e12_f32])
            .prop_map(|(near, far)| ClipPlanes { near, far })
    }

    proptest! {
        #[test]
        fn views_are_printed_and_parsed_to_the_bit(
            (eye, target, up, field, clip) in (point(), point(), point(), field(), clip())
        ) {
            let viewpoint = Viewpoint { eye, target, up, field, clip };
            prop_assume!(viewpoint.view(1.5).is_ok());
            let text = ViewArg::from(viewpoint).to_string();
            let parsed = parse_view(&text).map_err(TestCaseError::fail)?.0;
            prop_assert_eq!(format!("{parsed:?}"), format!("{viewpoint:?}"));
            let views = [parsed, viewpoint].map(|v| format!("{:?}", v.view(1.5)));
            prop_assert_eq!(&views[0], &views[1]);
        }
    }

    #[test]
    fn cameras_of_rooms_can_be_printed() {
        for name in builtin::NAMES {
            let scene = builtin::build(name, builtin::MovingObject::None).expect("it is built in");
            for camera in &scene.cameras {
                let viewpoint = Viewpoint::of(&scene, camera, 2.0);
                assert_eq!(parse_view(&ViewArg(viewpoint).to_string()), Ok(ViewArg(viewpoint)));
            }
        }
    }

    #[test]
    fn views_are_ten_numbers() {
        let text = "0,1.7,4,0,1.7,-1e-7,0,1,0,60";
        let parsed = parse_view(text).expect("a view");
        assert_eq!(parsed.to_string(), text);
        assert_eq!(parsed.0.field, FieldOfView::Perspective { degrees: 60.0 });
        let parallel = parse_view(" 0, 1.7, 4, 0, 1.7, 0, 0, 1, 0, 2.50m").expect("a view");
        assert_eq!(parallel.to_string(), "0,1.7,4,0,1.7,0,0,1,0,2.5m");
        let cut = "0,1.7,4,0,1.7,0,0,1,0,60,near=1.2,far=50";
        let planes = parse_view(cut).expect("a view").0.clip;
        assert_eq!(planes, ClipPlanes { near: 1.2, far: 50.0 });
        assert_eq!(parse_view(cut).expect("a view").to_string(), cut);
        for (wrong, fragment) in [
            ("0,1.7,4,0,1.7,0,0,1,0,60,near=x", "metres after near="),
            ("0,1.7,4,0,1.7,0,0,1,0,60,near=-1", "near plane"),
            ("0,1.7,4,0,1.7,0,0,1,0,60,near=3,far=2", "near plane"),
            ("0,1.7,4,0,1.7,0,0,1,0,60,far=2,near=1", "ten numbers"),
            ("", "ten numbers"),
            ("1,2,3", "ten numbers"),
            ("0,1.7,4,0,1.7,0,0,1,0,60,1", "ten numbers"),
            ("0,1.7,4,0,1.7,0,0,1,0,wide", "ten numbers"),
            ("0,1.7,4,0,1.7,0,0,1,0,60°", "ten numbers"),
            ("0,1.7,nan,0,1.7,0,0,1,0,60", "not finite"),
            ("0,1.7,inf,0,1.7,0,0,1,0,60", "not finite"),
            ("0,1.7,4,0,1.7,4,0,1,0,60", "same point"),
            ("0,1.7,4,0,9.7,4,0,1,0,60", "up"),
            ("0,1.7,4,0,1.7,0,0,1,0,180", "180"),
            ("0,1.7,4,0,1.7,0,0,1,0,-2m", "height"),
        ] {
            let said = parse_view(wrong).expect_err(wrong);
            assert!(said.contains(fragment), "{wrong}: {said}");
        }
    }
}
