//! What experiments give, and the page of all of them.

mod page;
mod picture;
mod plot;
mod table;

pub use page::Report;
pub use picture::{Picture, magnified};
pub use plot::{Curve, Plot, Scaling};
pub use table::{Table, number};

/// Whether what is seen is what the thesis shows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Verdict {
    /// It is.
    #[default]
    Agrees,
    /// It is not, for this reason, that a measurement bears out.
    Differs(String),
    /// The thesis claims nothing that could be compared.
    Shown,
}

/// What an experiment gives.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Curves.
    pub plots: Vec<Plot>,
    /// Pictures, side by side.
    pub pictures: Vec<Picture>,
    /// Numbers.
    pub tables: Vec<Table>,
    /// What we see, in sentences with numbers.
    pub seen: String,
    /// How exactly it was made: pixels, light samples, what else was set.
    pub settings: String,
    /// Whether that is what the thesis shows.
    pub verdict: Verdict,
}
