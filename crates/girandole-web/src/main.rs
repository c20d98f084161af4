//! `girandole-web`: what `cargo xtask web` and `cargo xtask test-web` build and run.

use anyhow::Result;
use clap::{Parser, Subcommand};
use girandole_web::package::{self, Part, Speed};
use girandole_web::serve::{Server, Site};
use girandole_web::test;
use std::path::PathBuf;
use std::process::ExitCode;

/// Girandole for browsers
#[derive(Parser)]
#[command(name = "girandole-web", bin_name = "cargo xtask")]
struct Cli {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Builds the page and the package for browsers
    #[command(
        name = "web",
        alias = "build",
        after_help = "Examples:
  cargo xtask web
  cargo xtask web --serve
  cargo xtask web --only package --quick -o /tmp/girandole"
    )]
    Web(WebArguments),
    /// Tests both in Chromium, with WebGPU on the processor
    #[command(
        name = "test-web",
        alias = "test",
        after_help = "Examples:
  cargo xtask test-web
  cargo xtask test-web --quick page
  cargo xtask test-web --list"
    )]
    Test(test::Arguments),
}

#[derive(clap::Args)]
struct WebArguments {
    /// Builds one of the two alone
    #[arg(long, value_name = "PART")]
    only: Option<Part>,
    /// Builds in a shorter time what is larger and slower
    #[arg(long)]
    quick: bool,
    /// Folder of the files: the page in it, the package in its folder `package`
    #[arg(short, long, value_name = "FOLDER", default_value = "target/web")]
    output: PathBuf,
    /// Then serves them to browsers on this machine, until Ctrl+C
    #[arg(long)]
    serve: bool,
    /// Port to serve at; 0 takes one that is free
    #[arg(long, value_name = "PORT", default_value_t = 8080)]
    port: u16,
}

fn main() -> ExitCode {
    let result = match Cli::parse().task {
        Task::Web(arguments) => web(&arguments),
        Task::Test(arguments) => test::run(&arguments),
    };
    result.unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        ExitCode::from(2)
    })
}

fn web(arguments: &WebArguments) -> Result<ExitCode> {
    let parts = arguments.only.map_or_else(|| Part::ALL.to_vec(), |part| vec![part]);
    let speed = if arguments.quick { Speed::Quick } else { Speed::Full };
    package::build(&parts, speed, &arguments.output)?;
    if arguments.serve {
        let server = Server::start(Site::folder(&arguments.output), arguments.port)?;
        eprintln!("serving {} at {}, until Ctrl+C", arguments.output.display(), server.address());
        server.wait();
    }
    Ok(ExitCode::SUCCESS)
}
