//! The soak test's server, which is a separate process on a machine that fails on demand.

use crate::process::Process;
use crate::tls::Identity;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{ChildStdin, ChildStdout, Command, Stdio};

pub struct Host {
    pub process: Process,
    orders: ChildStdin,
    answers: BufReader<ChildStdout>,
}

impl Host {
    /// Starts the server, which records into `dir`.
    pub fn start(dir: &Path) -> Host {
        Host::spawn(Command::new(env!("CARGO_BIN_EXE_shaky_host")).arg(dir))
    }

    /// Starts the server with TLS.
    pub fn start_with_tls(dir: &Path, identity: &Identity) -> Host {
        let files = ["certificate.pem", "key.pem"].map(|name| identity.path(name));
        Host::spawn(Command::new(env!("CARGO_BIN_EXE_shaky_host")).arg(dir).args(files))
    }

    fn spawn(command: &mut Command) -> Host {
        let mut child =
            command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("the host starts");
        let orders = child.stdin.take().expect("a pipe");
        let mut answers = BufReader::new(child.stdout.take().expect("a pipe"));
        let line = line(&mut answers);
        let (address, ops) = line.split_once(' ').expect("two addresses");
        let parse = |text: &str| text.parse().expect("an address");
        let process = Process { child, address: parse(address), ops: parse(ops) };
        Host { process, orders, answers }
    }

    /// Sends an order to the machine and waits until it has been carried out.
    pub fn order(&mut self, order: &str) {
        writeln!(self.orders, "{order}").expect("a live host");
        assert_eq!(line(&mut self.answers), "ok", "{order}");
    }
}

fn line(from: &mut impl BufRead) -> String {
    let mut line = String::new();
    from.read_line(&mut line).expect("a readable line");
    line.trim().to_owned()
}
