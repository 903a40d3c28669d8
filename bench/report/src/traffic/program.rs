//! The command line of the programs that measure traffic, one with Jostle's engine and one with a
//! peer.

use super::interest::{large_world, small_world};
use super::measure::{Scale, Traffic, watch};
use super::recording::Recording;
use super::sizes::{ENDING, GOLDENS, RENEW, TABLE, measure};
use super::{Crowd, SCENES, Script};
use anyhow::{Context, Result};
use clap::{Parser, Subcommand};
use std::fs;
use std::path::{Path, PathBuf};

/// Measures the cost of a client in each scene of `traffic`.
#[derive(Debug, Parser)]
pub struct Arguments {
    #[command(subcommand)]
    task: Option<Task>,
}

#[derive(Debug, Subcommand)]
enum Task {
    /// Play the scenes and print bytes per second, message sizes, bits per moved body and times (default)
    Play,
    /// Play A10k and compare the cost of a client that sees 900 of its bodies with one in K901
    Interest,
    /// Play the scenes and record a few seconds of each
    Record,
    /// Print the sizes of the recordings
    Sizes {
        /// Update the golden table with these sizes
        #[arg(long)]
        renew: bool,
    },
}

/// Creates an engine that contains the bodies of a script.
pub type Make = fn(&Script) -> Box<dyn Crowd>;

/// Executes the command; `engine` is used in file names.
pub fn run(arguments: &Arguments, engine: &str, make: Make) -> Result<()> {
    match arguments.task {
        None | Some(Task::Play) => play(make),
        Some(Task::Interest) => interest(make)?,
        Some(Task::Record) => record(engine, make)?,
        Some(Task::Sizes { renew }) => sizes(renew)?,
    }
    Ok(())
}

fn play(make: Make) {
    println!("scene  Hz  kB/s  on the wire  p50  p99  max  bits a move  encode us  decode us");
    for scene in SCENES {
        let mut script = scene();
        let mut crowd = make(&script);
        let mut scale = Scale::new(&[60, 20, 5]);
        watch(&mut script, &mut *crowd, u32::MAX, |snapshot| scale.weigh(&snapshot.into()));
        scale.finish().iter().for_each(|traffic| print(script.name, traffic));
    }
}

fn print(name: &str, traffic: &Traffic) {
    let [payload, wire] = traffic.bytes_per_s();
    let each = |us: f64| us / traffic.sizes.len().max(1) as f64;
    println!(
        "{:5} {:3} {:6.2} {:6.2} {:5} {:5} {:5} {:6.1} {:7.1} {:7.1}",
        name,
        traffic.rate,
        payload / 1000.0,
        wire / 1000.0,
        traffic.percentile(0.5),
        traffic.percentile(0.99),
        traffic.percentile(1.0),
        traffic.bits_per_moved(),
        each(traffic.encode_us),
        each(traffic.decode_us),
    );
}

fn interest(make: Make) -> Result<()> {
    println!(
        "scene  Hz  bodies  kB/s  on the wire  bits a move in view  times K901's: each  encode us"
    );
    for (base, seen) in small_world(make).iter().zip(large_world(make)?) {
        let [payload, wire] = base.bytes_per_s();
        let rate = base.rate;
        let bits = base.bits_per_moved();
        println!(
            "K901  {rate:3} {:5} {:6.2} {:6.2} {bits:5.2}",
            901,
            payload / 1000.0,
            wire / 1000.0
        );
        let [more, more_wire] = seen.bytes_per_s();
        println!(
            "A10k  {rate:3} {:5.0} {:6.2} {:6.2} {:5.2} {:5.2} {:5.2} {:5.2} {:6.1}",
            seen.bodies,
            more / 1000.0,
            more_wire / 1000.0,
            seen.bits_per_moved(),
            more / payload,
            more_wire / wire,
            seen.bits_per_moved() / bits,
            seen.encode_us,
        );
    }
    Ok(())
}

fn record(engine: &str, make: Make) -> Result<()> {
    for scene in SCENES {
        let mut script = scene();
        let mut crowd = make(&script);
        let mut recording = Recording { first_tick: script.ticks[0] + 1, positions: Vec::new() };
        let ticks = script.ticks_recorded;
        watch(&mut script, &mut *crowd, ticks, |snapshot| {
            recording.positions.push(snapshot.bodies.iter().map(|body| body.quanta).collect());
        });
        let path = goldens().join(format!("{}-{engine}.{ENDING}", script.name));
        fs::create_dir_all(goldens()).context("a directory for the recordings")?;
        let bytes = recording.pack();
        fs::write(&path, &bytes).with_context(|| format!("cannot write {}", path.display()))?;
        println!("{}: {} ticks, {} bytes", path.display(), recording.positions.len(), bytes.len());
    }
    println!("{RENEW}");
    Ok(())
}

fn sizes(renew: bool) -> Result<()> {
    let table = measure(&goldens())?;
    print!("{table}");
    if renew {
        fs::write(goldens().join(TABLE), table).context("cannot write the golden table")?;
    }
    Ok(())
}

/// Path of the golden files, independent of the working directory.
fn goldens() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(GOLDENS)
}
