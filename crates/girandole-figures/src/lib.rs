//! The figures of Barczak's thesis of 2006, and of what Girandole adds to it, made anew by one command: `cargo xtask figures`.
//!
//! A [`Figure`](figures::Figure) is an experiment. Run on a [`Bench`](bench::Bench) it gives an [`Outcome`](report::Outcome):
//! plots, pictures and tables, and what they show in numbers. A [`Report`](report::Report) is the page of all of them.

pub mod bench;
pub mod figures;
pub mod report;
