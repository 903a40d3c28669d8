//! `jostle doctor` checks the machine on which a server is to run. Each file checks one thing.

mod certificate;
mod clock;
mod cpu;
mod descriptors;
mod disk;
mod finding;
mod memory;
mod ports;

use crate::output::{Failure, json, say};
use crate::serve::Serve;
use clock::Clocks;
use cpu::Times;
use finding::Finding;
use jostle_server::log::Sync;
use serde::Serialize;
use std::time::SystemTime;

/// Check whether this machine is fit to run a server, and recommend changes
///
/// Takes the flags, environment and configuration file of `serve`. Run it as the server runs, with the same user and
/// limits, while the server is down. Prints one line each for open files, ports, directories, clock, processor, memory
/// and certificate, with a recommendation if something should be changed. It takes a few seconds, during which it plays
/// the largest scene. The status is 0 if everything is fine and 1 if something should be changed.
#[derive(clap::Args)]
#[command(mut_arg("check", |flag| flag.hide(true)))]
pub struct Doctor {
    #[command(flatten)]
    serve: Serve,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// All findings.
#[derive(Serialize)]
struct DoctorReport {
    fine: bool,
    findings: Vec<Finding>,
}

impl Doctor {
    /// Runs all checks and prints the findings.
    pub fn run(self) -> Result<(), Failure> {
        let findings = self.look()?;
        let to_change = findings.iter().filter(|finding| !finding.is_fine()).count();
        match self.json {
            true => say(json(&DoctorReport { fine: to_change == 0, findings }))?,
            false => findings.iter().try_for_each(say)?,
        }
        match to_change {
            0 => Ok(()),
            1 => Err(Failure::Check("one thing is to be changed".to_owned())),
            count => Err(Failure::Check(format!("{count} things are to be changed"))),
        }
    }

    fn look(&self) -> Result<Vec<Finding>, Failure> {
        let config = self.serve.config()?;
        let (connections, rooms) = (config.connections_max, config.rooms_in_all());
        let mut findings =
            vec![descriptors::look(connections, rooms), ports::look("--listen", self.serve.listen)];
        findings.extend(self.serve.ops.map(|address| ports::look("--ops", address)));
        let state = config.state.as_ref();
        findings
            .extend(state.map(|state| disk::look_at_state(&state.dir, state.sync == Sync::Second)));
        let replays = config.replays.as_ref();
        findings
            .extend(replays.map(|replays| disk::look_at_replays(&replays.dir, replays.bytes_max)));
        let (clocks, before) = (Clocks::now(), Times::now());
        let played = cpu::play_largest(&config.scenes);
        let times = [before, Times::now()];
        findings.push(clock::look(&clocks));
        let cores = jostle_server::limits::processors();
        findings.push(cpu::judge_speed(played, cores, !cfg!(debug_assertions)));
        findings.push(cpu::judge_steal(times));
        findings.push(memory::look(connections));
        let tls = config.tls.as_ref();
        findings.extend(tls.map(|tls| certificate::judge(tls.validity(), SystemTime::now())));
        Ok(findings)
    }
}
