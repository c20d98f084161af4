//! Options of precomputed radiance transfer.

use super::command_line::{Choice, text, value_name};
use clap::{Args, ValueEnum};
use girandole_core::math::sh::MAX_BANDS;
use girandole_core::transfer::{Compression, Gathering, TransferSettings};

/// Where the light is gathered that objects with transfer are lit by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum TransferArg {
    /// Nowhere: shadow maps light all objects
    #[default]
    Off,
    /// At the centre of an object: the same light for all of it
    #[value(alias = "center")]
    Centre,
    /// At points of a grid in an object's box
    Grid,
}

/// Options of transfer.
#[derive(Args, Clone, Debug, PartialEq)]
pub struct TransferArgs {
    /// Lights some objects by precomputed radiance transfer: they carry their own soft shadows and interreflection, simulated once and
    /// kept in the user's cache folder, and cost little to shade. In built-in rooms it is the moving object, in glTF files the nodes
    /// with extras {"transfer": true}, or those of --transfer-nodes. Where the light about an object is gathered: centre, grid
    #[arg(long, value_enum, default_value_t)]
    pub transfer: TransferArg,

    /// The nodes of a file whose objects have transfer, by name, those below them too
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub transfer_nodes: Vec<String>,

    /// Points along each axis of an object's box at which its light is gathered (--transfer grid)
    #[arg(long, value_name = "N", default_value_t = Gathering::GRID.points(), value_parser = clap::value_parser!(u32).range(1..=i64::from(Gathering::MOST_POINTS)))]
    pub transfer_points: u32,

    /// Bands of spherical harmonics: more show sharper shadows within an object, and cost the square
    #[arg(long, value_name = "N", default_value_t = TransferSettings::default().bands, value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_BANDS)))]
    pub transfer_bands: u32,

    /// Rays from each vertex of an object
    #[arg(long, value_name = "N", default_value_t = TransferSettings::default().directions, value_parser = clap::value_parser!(u32).range(64..=65_536))]
    pub transfer_rays: u32,

    /// How often an object with transfer reflects light to itself
    #[arg(long, value_name = "N", default_value_t = TransferSettings::default().bounces, value_parser = clap::value_parser!(u32).range(0..=64))]
    pub transfer_bounces: u32,

    /// Compresses transfer: vertices in so many clusters, each with so many bases (CPCA); off: none
    #[arg(long, value_name = "off|CLUSTERSxBASES", default_value = "off", value_parser = parse_compression)]
    pub transfer_compression: CompressionArg,
}

/// How transfer is compressed, if it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CompressionArg(pub Option<Compression>);

impl std::fmt::Display for CompressionArg {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self.0 {
            Some(Compression { clusters, bases }) => write!(f, "{clusters}x{bases}"),
            None => write!(f, "off"),
        }
    }
}

fn parse_compression(text: &str) -> Result<CompressionArg, String> {
    let wrong = || "give off, or clusters and bases, as in 16x8".to_owned();
    if text == "off" {
        return Ok(CompressionArg(None));
    }
    let (clusters, bases) = text.split_once('x').ok_or_else(wrong)?;
    let number = |text: &str| text.parse::<u32>().map_err(|_| wrong());
    let compression = Compression { clusters: number(clusters)?, bases: number(bases)? };
    let settings = TransferSettings { compression: Some(compression), ..TransferSettings::default() };
    settings.validate().map_err(|error| error.to_string())?;
    Ok(CompressionArg(Some(compression)))
}

impl TransferArgs {
    /// Where light is gathered, if any object has transfer.
    pub fn gathering(&self) -> Option<Gathering> {
        match self.transfer {
            TransferArg::Off => None,
            TransferArg::Centre => Some(Gathering::Center),
            TransferArg::Grid => Some(Gathering::Grid { points: self.transfer_points }),
        }
    }

    /// How transfer is simulated.
    pub fn settings(&self) -> TransferSettings {
        TransferSettings {
            bands: self.transfer_bands,
            directions: self.transfer_rays,
            bounces: self.transfer_bounces,
            compression: self.transfer_compression.0,
        }
    }

    /// The options' words on a command line.
    pub(super) fn choices(&self) -> [Choice; 7] {
        let Self { transfer, transfer_nodes: nodes, .. } = self;
        [
            ("--transfer", value_name(transfer)),
            ("--transfer-nodes", (!nodes.is_empty()).then(|| nodes.join(","))),
            ("--transfer-points", text(self.transfer_points)),
            ("--transfer-bands", text(self.transfer_bands)),
            ("--transfer-rays", text(self.transfer_rays)),
            ("--transfer-bounces", text(self.transfer_bounces)),
            ("--transfer-compression", text(self.transfer_compression)),
        ]
    }
}
