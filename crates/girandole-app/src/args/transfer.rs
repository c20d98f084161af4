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

    /// Clusters of transfer vectors that are compressed together: more have a smaller error; 0 does not compress
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=4096))]
    pub transfer_clusters: u32,

    /// Bases of each of these clusters: more have a smaller error, and are one more number a vertex
    #[arg(long, value_name = "N", default_value_t = Compression::default().bases, value_parser = clap::value_parser!(u32).range(0..=192))]
    pub transfer_bases: u32,
}

impl Default for TransferArgs {
    fn default() -> Self {
        let TransferSettings { bands, directions, bounces, .. } = TransferSettings::default();
        Self {
            transfer: TransferArg::Off,
            transfer_nodes: Vec::new(),
            transfer_points: Gathering::GRID.points(),
            transfer_bands: bands,
            transfer_rays: directions,
            transfer_bounces: bounces,
            transfer_clusters: 0,
            transfer_bases: Compression::default().bases,
        }
    }
}

impl TransferArgs {
    /// The same with light gathered there.
    pub fn with_gathering(mut self, gathering: Option<Gathering>) -> Self {
        self.transfer = match gathering {
            None => TransferArg::Off,
            Some(Gathering::Center) => TransferArg::Centre,
            Some(Gathering::Grid { points }) => {
                self.transfer_points = points;
                TransferArg::Grid
            }
        };
        self
    }

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
        let compression = Compression { clusters: self.transfer_clusters, bases: self.transfer_bases };
        TransferSettings {
            bands: self.transfer_bands,
            directions: self.transfer_rays,
            bounces: self.transfer_bounces,
            compression: (self.transfer_clusters > 0).then_some(compression),
        }
    }

    /// The options' words on a command line.
    pub(super) fn choices(&self) -> [Choice; 8] {
        let Self { transfer, transfer_nodes: nodes, .. } = self;
        [
            ("--transfer", value_name(transfer)),
            ("--transfer-nodes", (!nodes.is_empty()).then(|| nodes.join(","))),
            ("--transfer-points", text(self.transfer_points)),
            ("--transfer-bands", text(self.transfer_bands)),
            ("--transfer-rays", text(self.transfer_rays)),
            ("--transfer-bounces", text(self.transfer_bounces)),
            ("--transfer-clusters", text(self.transfer_clusters)),
            ("--transfer-bases", text(self.transfer_bases)),
        ]
    }
}
