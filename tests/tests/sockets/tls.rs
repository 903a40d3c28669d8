//! Tests of the players' port with TLS, with certificates generated for each test.

use crate::client::{Client, LONG};
use crate::http::{Answer, raw_over};
use crate::process::Process;
use crate::server::Server;
use jostle_protocol::{Refusal, ServerMessage};
use jostle_server::Config;
use jostle_server::limits::Timeouts;
use jostle_server::net::tls::{Tls, date};
use jostle_tests::program::jostle;
use jostle_tests::server::{BRIEF, PATIENT, patient};
use rcgen::{CertificateParams, CertifiedKey, KeyPair, date_time_ymd, generate_simple_self_signed};
use std::fs;
use std::net::SocketAddr;
#[cfg(unix)]
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::{sleep, timeout};
use tokio_rustls::TlsConnector;
use tokio_rustls::client::TlsStream;
use tokio_rustls::rustls::crypto::ring;
use tokio_rustls::rustls::pki_types::ServerName;
use tokio_rustls::rustls::{ClientConfig, RootCertStore};

/// The unit that operators install.
const UNIT: &str = include_str!("../../../deploy/jostle.service");
/// The server's name in the certificates.
const NAME: &str = "jostle.example.org";
const GET: &str = "GET / HTTP/1.1\r\nHost: jostle.example.org\r\nConnection: close\r\n\r\n";

/// A certificate for [`NAME`], stored in files.
pub struct Identity {
    dir: PathBuf,
    made: CertifiedKey<KeyPair>,
}

impl Identity {
    pub fn new(test: &str) -> Identity {
        let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("tls-{test}"));
        fs::create_dir_all(&dir).expect("a directory");
        let made = generate_simple_self_signed([NAME.to_owned()]).expect("a certificate");
        let identity = Identity { dir, made };
        identity.write("certificate.pem", &identity.made.cert.pem());
        identity.write("key.pem", &identity.made.signing_key.serialize_pem());
        identity
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        fs::write(self.path(name), text).expect("a writable directory");
        self.path(name)
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.join(name)
    }

    /// Replaces this identity's files with those of another.
    fn become_of(&self, other: &Identity) {
        for name in ["certificate.pem", "key.pem"] {
            fs::copy(other.path(name), self.path(name)).expect("a copied file");
        }
    }

    /// Waits until the server presents this identity's certificate to new connections.
    async fn is_shown(&self, address: SocketAddr) {
        let shown = async {
            while self.connect(address).await.is_err() {
                sleep(Duration::from_millis(20)).await;
            }
        };
        timeout(LONG, shown).await.expect("the certificate in time");
    }

    async fn serve(&self, waits: Timeouts) -> Server {
        let tls = Tls::read(&self.path("certificate.pem"), &self.path("key.pem"));
        let tls = Some(tls.unwrap_or_else(|error| panic!("{error}")));
        Server::start_with(Config { tls, waits, ..patient() }).await
    }

    /// Connects to a server, which must present this identity's certificate.
    pub async fn connect(&self, address: SocketAddr) -> std::io::Result<TlsStream<TcpStream>> {
        let mut roots = RootCertStore::empty();
        roots.add(self.made.cert.der().clone()).expect("a certificate");
        let config = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()))
            .with_safe_default_protocol_versions()
            .expect("versions that ring can do")
            .with_root_certificates(roots)
            .with_no_client_auth();
        let stream = TcpStream::connect(address).await.expect("a connection");
        let name = ServerName::try_from(NAME).expect("a name");
        let shaken = TlsConnector::from(Arc::new(config)).connect(name, stream);
        timeout(LONG, shaken).await.expect("a handshake in time")
    }

    async fn get(&self, address: SocketAddr) -> Answer {
        raw_over(self.connect(address).await.expect("a handshake"), GET).await
    }

    async fn join(&self, address: SocketAddr) -> Client<TlsStream<TcpStream>> {
        let stream = self.connect(address).await.expect("a handshake");
        let mut client = Client::upgraded(stream, &format!("wss://{NAME}/arena")).await;
        client.enter("Ann", None).await;
        client
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn pages_load_and_players_play_to_the_end() {
    let identity = Identity::new("play");
    let mut server = identity.serve(PATIENT).await;
    assert_eq!(identity.get(server.address).await.status, 200);
    let mut ann = identity.join(server.address).await;
    ann.keeps_playing().await;
    server.stop();
    while !matches!(ann.message().await, ServerMessage::Draining { .. }) {}
    ann.is_refused(Refusal::Closing).await;
    drop(ann);
    server.ended().await;
}

/// Reads until the server closes the connection.
async fn until_closed(mut stream: TcpStream) {
    let mut bytes = Vec::new();
    // A reset ends the connection too.
    let _ = timeout(LONG, stream.read_to_end(&mut bytes)).await.expect("an end in time");
    assert!(!bytes.starts_with(b"HTTP"), "nothing is served in the clear");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn failed_handshakes_are_closed_and_counted() {
    let identity = Identity::new("refused");
    let server = identity.serve(Timeouts { http_head: BRIEF, ..PATIENT }).await;
    let mut ann = identity.join(server.address).await;
    // A client that sends plain text.
    let mut plain = TcpStream::connect(server.address).await.expect("a connection");
    plain.write_all(GET.as_bytes()).await.expect("a live socket");
    until_closed(plain).await;
    // A client that rejects the certificate.
    let stranger = Identity::new("stranger");
    assert!(stranger.connect(server.address).await.is_err(), "another certificate");
    server.counts("jostle_refusals_total{reason=\"bad_tls\"}", 2).await;
    // A client that sends nothing.
    until_closed(TcpStream::connect(server.address).await.expect("a connection")).await;
    server.counts("jostle_refusals_total{reason=\"slow_tls\"}", 1).await;
    ann.keeps_playing().await;
}

#[test]
fn unusable_files_are_named() {
    let ours = Identity::new("files");
    let other = Identity::new("other-files");
    let empty = ours.write("empty.pem", "");
    let broken = ours.write("broken.pem", "-----BEGIN CERTIFICATE-----\nAAAA\n");
    let hollow =
        ours.write("hollow.pem", "-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n");
    let (certificate, key) = (ours.path("certificate.pem"), ours.path("key.pem"));
    let (missing, foreign) = (ours.path("missing.pem"), other.path("key.pem"));
    for (certificate, key, option, file, found) in [
        (&missing, &key, "--tls-cert", &missing, "no file to read ("),
        (&empty, &key, "--tls-cert", &empty, "no certificate;"),
        (&key, &key, "--tls-cert", &key, "no certificate;"),
        (&broken, &key, "--tls-cert", &broken, "no PEM ("),
        (&hollow, &key, "--tls-key", &key, ""),
        (&certificate, &missing, "--tls-key", &missing, "no file to read ("),
        (&certificate, &certificate, "--tls-key", &certificate, "no private key in the clear;"),
        (&certificate, &foreign, "--tls-key", &foreign, ""),
    ] {
        let error = Tls::read(certificate, key).expect_err("files that cannot serve").to_string();
        let location = format!("{option} {}: found {found}", file.display());
        assert!(error.contains(&location) && error.contains("; allowed: "), "{error}");
    }
    Tls::read(&certificate, &key).unwrap_or_else(|error| panic!("{error}"));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_program_serves_with_files_from_the_command_line() {
    let identity = Identity::new("process");
    let [certificate, key] = ["certificate.pem", "key.pem"].map(|name| identity.path(name));
    let serve = move || {
        let [certificate, key] = [&certificate, &key].map(|path| path.to_str().expect("text"));
        let files = ["--tls-cert", certificate, "--tls-key", key];
        Process::serve(&[&files[..], &["--host", NAME]].concat(), Stdio::inherit())
    };
    let process = tokio::task::spawn_blocking(serve).await.expect("a server");
    let answer = identity.get(process.address).await;
    assert_eq!(answer.status, 200);
    assert_eq!(answer.header("strict-transport-security"), Some("max-age=31536000"));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_changed_certificate_is_taken_up_by_itself() {
    let (old, new) = (Identity::new("changed"), Identity::new("changed-new"));
    let waits = Timeouts { certificate_look: Duration::from_millis(50), ..PATIENT };
    let server = old.serve(waits).await;
    let mut ann = old.join(server.address).await;
    old.become_of(&new);
    new.is_shown(server.address).await;
    assert!(old.connect(server.address).await.is_err(), "the certificate of before");
    ann.keeps_playing().await;
}

/// Waits until the log contains a text `times` times.
#[cfg(unix)]
async fn logged(log: &Path, text: &str, times: usize) {
    let said = async {
        while fs::read_to_string(log).expect("a log").matches(text).count() < times {
            sleep(Duration::from_millis(20)).await;
        }
    };
    timeout(LONG, said).await.unwrap_or_else(|_| panic!("{text:?} is not in {}", log.display()));
}

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_hangup_has_the_certificate_read_again() {
    let (old, new) = (Identity::new("hangup"), Identity::new("hangup-new"));
    let [certificate, key] = ["certificate.pem", "key.pem"].map(|name| old.path(name));
    let log = old.write("log", "");
    let to = fs::File::create(&log).expect("a file");
    let serve = move || {
        let [certificate, key] = [&certificate, &key].map(|path| path.to_str().expect("text"));
        let files = ["--tls-cert", certificate, "--tls-key", key, "--log", "info"];
        Process::serve(&[&files[..], &["--host", NAME]].concat(), to.into())
    };
    let process = tokio::task::spawn_blocking(serve).await.expect("a server");
    let mut ann = old.join(process.address).await;
    // The file has not changed, so it is read only because of the signal.
    process.signal("HUP");
    logged(&log, "it is unchanged", 1).await;
    // An unusable file is reported, and the previous file stays in use.
    old.write("certificate.pem", "nonsense");
    process.signal("HUP");
    let reason =
        format!("--tls-cert {}: found no certificate;", old.path("certificate.pem").display());
    logged(&log, &reason, 1).await;
    old.connect(process.address).await.expect("the certificate of before");
    old.become_of(&new);
    process.signal("HUP");
    new.is_shown(process.address).await;
    logged(&log, "it is a new one", 1).await;
    assert!(old.connect(process.address).await.is_err(), "the certificate of before");
    ann.keeps_playing().await;
}

/// The lines that have the given key in the recipes at the top of the unit file.
#[cfg(unix)]
fn recipe(key: &str) -> Vec<String> {
    let lines = UNIT.lines().filter_map(|line| line.strip_prefix("#   "));
    lines.filter(|line| line.starts_with(&format!("{key}="))).map(str::to_owned).collect()
}

#[cfg(unix)]
#[test]
fn the_unit_and_its_recipe_for_tls_are_right() {
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join("unit");
    let drop_in = dir.join("jostle.service.d");
    fs::create_dir_all(&drop_in).expect("a directory");
    let (unit, program) = (dir.join("jostle.service"), jostle());
    let program = program.to_str().expect("text");
    fs::write(&unit, UNIT.replace("/usr/local/bin/jostle", program)).expect("a file");
    let lines = [recipe("LoadCredential"), recipe("Environment")].concat();
    assert_eq!(lines.len(), 3, "{lines:?}");
    let text = format!("[Service]\n{}\n", lines.join("\n"));
    fs::write(drop_in.join("override.conf"), text).expect("a file");
    let verified = Command::new("systemd-analyze").arg("verify").arg(&unit).output();
    // This program may be missing on some machines.
    let Ok(verified) = verified else { return };
    let said = String::from_utf8_lossy(&verified.stderr);
    assert!(verified.status.success() && !said.contains("jostle.service"), "{said}");
}

/// Creates credentials as systemd does, as copies that only their owner may read, in a directory that is equally
/// protected.
#[cfg(unix)]
fn hand_over(identity: &Identity, name: &str, credential: &str) {
    let dir = identity.path("credentials");
    fs::create_dir_all(&dir).expect("a directory");
    let copy = dir.join(credential);
    let _ = fs::remove_file(&copy);
    fs::copy(identity.path(name), &copy).expect("a copied file");
    fs::set_permissions(copy, fs::Permissions::from_mode(0o400)).expect("an own file");
}

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn credentials_of_the_unit_serve_and_do_not_follow_a_renewal() {
    let (old, new) = (Identity::new("credentials"), Identity::new("credentials-new"));
    hand_over(&old, "certificate.pem", "cert");
    hand_over(&old, "key.pem", "key");
    let credentials = old.path("credentials");
    let [line] = recipe("Environment").try_into().expect("one line");
    let line = line.replace("%d", credentials.to_str().expect("text"));
    let words = line.strip_prefix("Environment=").expect("variables").split(' ');
    let variables: Vec<_> = words
        .map(|word| word.split_once('=').expect("a variable"))
        .map(|(name, value)| (name.to_owned(), value.to_owned()))
        .collect();
    let log = old.write("log", "");
    let to = fs::File::create(&log).expect("a file");
    let serve =
        move || Process::serve_with(&variables, &["--log", "info", "--host", NAME], to.into());
    let process = tokio::task::spawn_blocking(serve).await.expect("a server");
    assert_eq!(old.get(process.address).await.status, 200);
    old.become_of(&new);
    process.signal("HUP");
    logged(&log, "it is unchanged", 1).await;
}

#[test]
fn the_times_of_a_certificate_are_read() {
    let mut asked = CertificateParams::new([NAME.to_owned()]).expect("a name");
    (asked.not_before, asked.not_after) = (date_time_ymd(2001, 2, 3), date_time_ymd(2030, 4, 5));
    let identity = Identity::new("times");
    let key = &identity.made.signing_key;
    identity.write("certificate.pem", &asked.self_signed(key).expect("a certificate").pem());
    let tls = Tls::read(&identity.path("certificate.pem"), &identity.path("key.pem"));
    let times = tls.expect("good files").validity().expect("times");
    assert_eq!([date(times.from), date(times.until)], ["2001-02-03", "2030-04-05"]);
}
