//! The project's tasks, such as building the web client, playing, testing and tidying. `cargo xtask help` lists them.
//!
//! Each task does the necessary set-up and prints one line per step. None of this is needed to use the crates: plain
//! `cargo build` and `cargo test` work without it.

mod dist;
mod docs;
mod fuzz;
mod gallery;
mod goldens;
mod hashes;
#[cfg(test)]
mod lints;
mod measure;
mod packages;
mod pictures;
mod play;
mod shell;
mod test;
mod tidy;
mod web;
mod workspace;

use anyhow::Result;
use clap::{Parser, Subcommand};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;

/// Tasks of the Jostle workspace.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Build everything, serve it and open the page
    Play {
        /// Address to serve on; 0.0.0.0:8080 lets others on your network join
        #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:8080")]
        listen: SocketAddr,
        /// Do not open a browser
        #[arg(long)]
        no_open: bool,
    },
    /// Run all checks of continuous integration
    Test {
        /// Skip the browser tests
        #[arg(long)]
        quick: bool,
        /// Also run the tests for a release: other builds of the simulation, 64-bit Arm, and the measuring programs
        #[arg(long, conflicts_with = "quick")]
        all: bool,
        /// Run only the fast tests of code affected by changes since a revision
        #[arg(long, value_name = "REV", conflicts_with = "all")]
        since: Option<String>,
        /// Update the golden replays and hashes in tests/goldens instead of testing
        #[arg(long, conflicts_with_all = ["quick", "all", "since"])]
        update_hashes: bool,
    },
    /// Run a single step of the tests
    #[command(hide = true)]
    TestStep {
        name: String,
        #[arg(long, value_delimiter = ',')]
        packages: Vec<String>,
    },
    /// Build the web client into client-web/dist
    Web {
        /// Compile in seconds instead of minutes; the result is larger and slower
        #[arg(long)]
        dev: bool,
        /// Also write a version that needs no server into target/static, for any file host
        #[arg(long = "static")]
        is_static: bool,
    },
    /// Check the scenes of the gallery, let bots play them, and draw them for a page in target/gallery
    Gallery {
        /// Address of the page that plays the scenes, to which the gallery links
        #[arg(long, value_name = "ADDRESS", default_value = "../static/")]
        page: String,
        /// Also put the pictures next to the scenes in assets/gallery, where `jostle serve --gallery` finds them
        #[arg(long)]
        keep: bool,
    },
    /// Build, test and pack a release into target/dist: static programs for 64-bit x86 and Arm, licences, lists of
    /// crates
    Dist {
        /// Private SSH key with which to sign the digests
        #[arg(long, value_name = "FILE")]
        sign: Option<PathBuf>,
    },
    /// Check the conventions of the code base: links, dependencies, cycles, file sizes, words
    Tidy {
        /// Print figures about the size and coupling of the code instead
        #[arg(long)]
        figures: bool,
        /// Measure another checkout, for comparison
        #[arg(long, value_name = "DIR", requires = "figures")]
        root: Option<PathBuf>,
    },
    /// Write the tables of fields in docs/scenes.md, the schema of scene files and the classes for Tiled
    Docs,
    /// Try the decoders, replays, scenes, rooms and handshakes on millions of broken inputs
    Fuzz {
        /// Try only this property, such as keyframe
        property: Option<String>,
        /// Seconds per property
        #[arg(long, value_name = "N", default_value_t = 60)]
        seconds: u32,
    },
    /// Measure error against run time, and stability, and write a page with plots and tables
    Report {
        /// Take a few minutes instead of an hour, with fewer runs and without the largest variants
        #[arg(long)]
        quick: bool,
        /// Compile Box2D and rapier2d and measure them too
        #[arg(long)]
        peers: bool,
        /// Folder for the page
        #[arg(long, value_name = "DIR", default_value = "target/report")]
        out: PathBuf,
    },
    /// Measure the time from a key press to the frame that shows it
    Latency {
        /// Key presses per case
        #[arg(long, value_name = "N", default_value_t = 200)]
        presses: u32,
        /// File for the figures as JSON
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// Measure the server under load: a crowd in one room, many rooms, newcomers and lost sockets
    Load {
        /// Also count the server's allocations, which makes it slightly slower
        #[arg(long)]
        allocations: bool,
        /// Options of the measurement: --clients, --rooms, --seconds, --reconnects
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        options: Vec<String>,
    },
    /// Play a hundred matches of each game against bots, and print who wins
    Bots {
        /// Seed of the first match; the others follow it
        #[arg(long, default_value_t = 0)]
        seed: u64,
    },
    /// Simulate the directory of fleets of several sizes and its response to failures
    Fleet {
        /// Options of the simulation: --nodes, --rooms, --seed
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        options: Vec<String>,
    },
    /// Take the README's screenshot from a game with three players
    Pictures,
    /// Open a page once its server responds
    #[command(hide = true)]
    OpenWhenReady { link: String, address: SocketAddr },
}

fn main() -> ExitCode {
    match run(Arguments::parse().task) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("xtask: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Runs a task; returns whether it succeeded. Failures have already been reported.
fn run(task: Task) -> Result<bool> {
    match task {
        Task::Play { listen, no_open } => play::play(listen, !no_open)?,
        Task::Test { update_hashes: true, .. } => {
            goldens::update()?;
            hashes::update()?;
        }
        Task::Test { quick, all, since, .. } => {
            let extent = match (quick, all) {
                (true, _) => test::TestExtent::Quick,
                (_, true) => test::TestExtent::All,
                _ => test::TestExtent::Usual,
            };
            return test::test(extent, since.as_deref());
        }
        Task::TestStep { name, packages } => std::process::exit(test::step(&name, &packages)),
        Task::Web { dev, is_static } => {
            let profile = if dev { web::Profile::Dev } else { web::Profile::Small };
            if is_static { web::build_static(profile)? } else { web::build(profile)? }
        }
        Task::Gallery { page, keep } => gallery::gallery(&page, keep)?,
        Task::Dist { sign } => dist::dist(sign.as_deref())?,
        Task::Docs => docs::docs()?,
        Task::Tidy { figures: false, .. } => tidy::tidy()?,
        Task::Tidy { root, .. } => tidy::figures(&root.unwrap_or_else(shell::root))?,
        Task::Fuzz { property, seconds } => fuzz::fuzz(property.as_deref(), seconds)?,
        Task::Latency { presses, json } => measure::latency(presses, json.as_deref())?,
        Task::Bots { seed } => measure::bots(seed)?,
        Task::Fleet { options } => measure::fleet(&options)?,
        Task::Load { allocations, options } => measure::load(&options, allocations)?,
        Task::Pictures => pictures::take()?,
        Task::Report { quick, peers, out } => measure::report(quick, peers, &out)?,
        Task::OpenWhenReady { link, address } => play::open_when_ready(&link, address)?,
    }
    Ok(true)
}
