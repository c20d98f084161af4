//! What the command line says.

use crate::Failure;
use bevy::prelude::Resource;
use std::path::PathBuf;

#[derive(Resource, Clone, Debug)]
pub struct Options {
    /// Where the picture goes; a window without it.
    pub picture: Option<PathBuf>,
    pub hdr: Option<PathBuf>,
    pub export: Option<PathBuf>,
    pub frames: u32,
    /// Frames after that before the picture is taken, in which light samples catch up.
    pub rest: u32,
    pub size: [u32; 2],
    pub lamps: u32,
    pub samples: u32,
    pub bounces: u32,
    pub anew: bool,
    pub bevy: bool,
}

impl Options {
    pub fn read(mut arguments: impl Iterator<Item = String>) -> Result<Self, Failure> {
        let mut options = Self {
            picture: None,
            hdr: None,
            export: None,
            frames: 60,
            rest: 20,
            size: [960, 540],
            lamps: 64,
            samples: 1024,
            bounces: 5,
            anew: false,
            bevy: false,
        };
        while let Some(name) = arguments.next() {
            let mut value = || arguments.next().ok_or_else(|| format!("{name} needs a value after it"));
            match name.as_str() {
                "--headless" => options.picture = Some(value()?.into()),
                "--hdr" => {
                    let path: PathBuf = value()?.into();
                    options.picture.get_or_insert_with(|| path.clone());
                    options.hdr = Some(path);
                }
                "--export" => options.export = Some(value()?.into()),
                "--frames" => options.frames = value()?.parse()?,
                "--rest" => options.rest = value()?.parse()?,
                "--size" => {
                    let text = value()?;
                    let (width, height) = text.split_once('x').ok_or("give --size as 960x540")?;
                    options.size = [width.parse()?, height.parse()?];
                }
                "--lamps" => options.lamps = value()?.parse()?,
                "--samples" => options.samples = value()?.parse()?,
                "--bounces" => options.bounces = value()?.parse()?,
                "--anew" => options.anew = true,
                "--bevy" => options.bevy = true,
                _ => {
                    return Err(
                        format!("there is no option {name}; the example's first lines list all").into()
                    );
                }
            }
        }
        Ok(options)
    }
}
