//! `cargo xtask fleet`: the directory code that servers run, with thousands of simulated nodes, a simulated store and
//! failures. Measures the load on the store and how long rooms are without a node, and checks that no two nodes ever
//! play the same room.

mod alone;

use anyhow::{Result, anyhow};
use clap::Parser;
use jostle_simulation::{Bucket, Faults, Flaws, Settings, Simulation, Traffic};
use rustix::time::{ClockId, clock_gettime};
use std::time::Duration;

/// Time allowed for starting the nodes and opening the rooms.
const OPENING: Duration = Duration::from_secs(60);
/// Duration of each part.
const PART: Duration = Duration::from_secs(60);
/// Percentage of the nodes that are in one zone.
const ZONE_SHARE: usize = 33;
/// Number of nodes that drain one after another, and the interval between them.
const DRAINS: usize = 10;
const DRAIN_EVERY: Duration = Duration::from_secs(3);
/// How long a store of three servers does not respond after losing its leader.
const LEADER_LOST: Duration = Duration::from_secs(7);

/// Simulates failures in fleets of several sizes, measures their directory and prints the results
#[derive(Parser)]
struct Fleet {
    /// Sizes of the simulated fleets, separated by commas
    #[arg(long, value_name = "N,N", value_delimiter = ',', default_value = "10,30,100,300")]
    nodes: Vec<usize>,
    /// Rooms per node
    #[arg(long, value_name = "N", default_value_t = 40)]
    rooms: usize,
    /// Sizes of fleets in which a single node is measured, separated by commas
    #[arg(long, value_name = "N,N", value_delimiter = ',', default_value = "100,300,1000,3000")]
    alone: Vec<usize>,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

fn main() -> Result<()> {
    let fleet = Fleet::parse();
    for nodes in &fleet.nodes {
        run(*nodes, &fleet)?;
    }
    for nodes in &fleet.alone {
        alone::run(*nodes, fleet.rooms)?;
    }
    Ok(())
}

fn run(nodes: usize, fleet: &Fleet) -> Result<()> {
    let settings = Settings {
        seed: fleet.seed,
        nodes,
        lasting: nodes,
        rooms: nodes * fleet.rooms,
        ending: 0,
        // Enough for the other nodes to take over a zone's rooms.
        rooms_max: fleet.rooms * 2,
        faulty_for: 2 * OPENING,
        faults: Faults { skew: 0.001, ..Faults::default() },
        flaws: Flaws::default(),
    };
    println!("{nodes} nodes with {} rooms each", fleet.rooms);
    let mut simulation = Simulation::new(settings);
    // Rooms open during the first half of the period with faults.
    advance(&mut simulation, OPENING + PART / 2)?;
    let quiet = part(&mut simulation, "nothing happens", |_| Ok(()))?;
    println!(
        "  a node's part: {:.2} ms of a processor a second; the store sends each {:.1} kB a second",
        1e3 * quiet.processor_s / PART.as_secs_f64() / nodes as f64,
        quiet.delivered_bytes / 1e3 / nodes as f64,
    );
    part(&mut simulation, "the store's leader is lost", |simulation| {
        simulation.lose_leader(LEADER_LOST);
        Ok(())
    })?;
    let (before, drained) = (simulation.moves(), DRAINS.min(nodes / 2));
    part(&mut simulation, "nodes drain one after another, and are started again", |simulation| {
        for node in 0..drained {
            simulation.drain(node).map_err(violated)?;
            advance(simulation, DRAIN_EVERY)?;
            simulation.die(node);
            simulation.revive(node);
        }
        Ok(())
    })?;
    println!("  rooms moved: {} from {drained} nodes", simulation.moves() - before);
    let known = simulation.gaps().len();
    let zone = (nodes * ZONE_SHARE / 100).max(1);
    part(&mut simulation, "a third of the nodes is lost at once", |simulation| {
        (nodes - zone..nodes).for_each(|node| simulation.die(node));
        Ok(())
    })?;
    let mut gaps = simulation.gaps()[known..].to_vec();
    gaps.sort();
    let at = |share: usize| gaps.get((gaps.len() * share / 100).min(gaps.len() - 1));
    println!(
        "  rooms claimed: {}, after {:.1?} (p50), {:.1?} (p99), {:.1?} (max); {} wait for capacity",
        gaps.len(),
        at(50).unwrap_or(&Duration::ZERO),
        at(99).unwrap_or(&Duration::ZERO),
        at(100).unwrap_or(&Duration::ZERO),
        simulation.waiting(),
    );
    println!("  rooms played by two nodes at a time: none, as checked after each event");
    Ok(())
}

/// The measurements of a part.
struct Part {
    /// Number of bytes per second sent to watchers.
    delivered_bytes: f64,
    /// Total processor time of all nodes and the simulation in seconds.
    processor_s: f64,
}

/// Runs a part that starts with an incident, and measures it.
fn part(
    simulation: &mut Simulation,
    name: &str,
    happens: impl FnOnce(&mut Simulation) -> Result<()>,
) -> Result<Part> {
    let traffic = |simulation: &Simulation| {
        [Bucket::Nodes, Bucket::Rooms].map(|bucket| simulation.traffic(bucket))
    };
    let (before, began) = (traffic(simulation), processor_time());
    let end = simulation.now() + PART;
    happens(simulation)?;
    simulation.run_until(end).map_err(violated)?;
    let after = traffic(simulation);
    let processor_s = (processor_time() - began).as_secs_f64();
    let a_second = |count: fn(&Traffic) -> u64| {
        let total = |of: &[Traffic; 2]| of.iter().map(count).sum::<u64>();
        (total(&after) - total(&before)) as f64 / PART.as_secs_f64()
    };
    println!(
        "  {name}: {:.0} writes a second ({:.1} kB), {:.0} refused, {:.0} deliveries ({:.2} MB), {:.1} looks",
        a_second(|traffic| traffic.writes),
        a_second(|traffic| traffic.written_bytes) / 1e3,
        a_second(|traffic| traffic.refused),
        a_second(|traffic| traffic.deliveries),
        a_second(|traffic| traffic.delivered_bytes) / 1e6,
        a_second(|traffic| traffic.looks),
    );
    Ok(Part { delivered_bytes: a_second(|traffic| traffic.delivered_bytes), processor_s })
}

fn advance(simulation: &mut Simulation, time: Duration) -> Result<()> {
    let until = simulation.now() + time;
    simulation.run_until(until).map_err(violated)
}

fn violated(violation: jostle_simulation::Violation) -> anyhow::Error {
    anyhow!("two nodes, or a lost room: {violation}")
}

fn processor_time() -> Duration {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}
