//! TLS on the players' port: reads the certificates and the key, rereads them when they change, and performs the
//! handshake. It supports only TLS 1.3, which is spoken by every browser that can draw the page, and only HTTP/1.1,
//! which carries the WebSockets.

use crate::files::read_regular;
use crate::limits;
use crate::log::calendar;
use crate::net::maybe_tls_stream::{MaybeTlsStream, Socket};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError, RwLock};
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use tokio::sync::Notify;
use tokio::task::spawn_blocking;
use tokio::time::timeout;
use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::client::verify_server_cert_signed_by_trust_anchor;
use tokio_rustls::rustls::crypto::ring;
use tokio_rustls::rustls::pki_types::pem::{self, PemObject};
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer, UnixTime};
use tokio_rustls::rustls::server::ParsedCertificate;
use tokio_rustls::rustls::{self, CertificateError, RootCertStore, ServerConfig, version};
use tracing::{error, info};

/// Maximum number of encrypted bytes waiting for one socket; the default in rustls is 64 KiB.
const TLS_BUFFER_BYTES_MAX: usize = 16 << 10;

/// The server's certificates and key. Cheap to clone; all clones change together.
#[derive(Clone, Debug)]
pub struct Tls(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    /// The certificate file and the key file.
    files: [PathBuf; 2],
    pair: RwLock<LoadedPair>,
    read_again: Notify,
}

/// The loaded certificates and key.
#[derive(Clone, Debug)]
struct LoadedPair {
    config: Arc<ServerConfig>,
    /// The certificates in the configuration.
    chain: Arc<[CertificateDer<'static>]>,
    validity: Option<Validity>,
    /// The state of the files before they were read.
    stamps: Stamps,
}

/// Length and modification time of each file; `None` if it cannot be found.
type Stamps = [Option<(u64, SystemTime)>; 2];

/// An error from [`Tls::read`].
#[derive(Debug, thiserror::Error)]
pub enum TlsError {
    /// The certificates cannot be read.
    #[error(
        "--tls-cert {}: found {found}; allowed: a PEM file with one CERTIFICATE or more, the server's \
         own first", file.display()
    )]
    Certificates {
        /// The file that should contain the certificates.
        file: PathBuf,
        /// A description of what was found.
        found: String,
    },
    /// The key cannot be read.
    #[error(
        "--tls-key {}: found {found}; allowed: a PEM file with a PRIVATE KEY, EC PRIVATE KEY or RSA \
         PRIVATE KEY, not encrypted", file.display()
    )]
    Key {
        /// The file that should contain the key.
        file: PathBuf,
        /// A description of what was found.
        found: String,
    },
    /// Both can be read, but the key does not match the certificate.
    #[error(
        "--tls-cert {} with --tls-key {}: found {found}; allowed: the key of the first certificate, \
         Ed25519, ECDSA or RSA", certificates.display(), key.display()
    )]
    Pair { certificates: PathBuf, key: PathBuf, found: rustls::Error },
}

impl Tls {
    /// Reads two PEM files, and checks that the key belongs to the first certificate.
    pub fn read(certificates: &Path, key: &Path) -> Result<Tls, TlsError> {
        let files = [certificates.to_owned(), key.to_owned()];
        let pair = RwLock::new(read_pair(&files)?);
        Ok(Tls(Arc::new(Shared { files, pair, read_again: Notify::new() })))
    }

    /// Performs the handshake, without a time limit. If the peer violates the protocol, the error is
    /// [`io::ErrorKind::InvalidData`]; other errors come from the socket.
    pub async fn accept(&self, stream: Socket) -> io::Result<MaybeTlsStream> {
        let mut stream = TlsAcceptor::from(self.pair().config).accept(stream).await?;
        stream.get_mut().1.set_buffer_limit(Some(TLS_BUFFER_BYTES_MAX));
        Ok(MaybeTlsStream::Right(Box::new(stream)))
    }

    /// The first certificate's validity, if it can be read.
    pub fn validity(&self) -> Option<Validity> {
        self.pair().validity
    }

    /// Makes [`Tls::keep_current`] read the files now, whether or not they have changed.
    pub fn read_again(&self) {
        self.0.read_again.notify_one();
    }

    /// Runs forever and rereads the files whenever they change. New connections use the new files; existing ones keep
    /// theirs. Unusable files are logged and change nothing. `every` is the interval between checks. A change is
    /// applied once two checks agree, because the files are written one after the other.
    pub async fn keep_current(&self, every: Duration) {
        let mut known = self.pair().stamps;
        let mut seen = known;
        loop {
            let is_asked = timeout(every, self.0.read_again.notified()).await.is_ok();
            let tls = self.clone();
            let looked = spawn_blocking(move || {
                let stamps = stamps(&tls.0.files);
                let is_taken_up = is_asked || (stamps != known && stamps == seen);
                if is_taken_up {
                    tls.replace();
                }
                (if is_taken_up { stamps } else { known }, stamps)
            });
            // This task is cancelled only when the runtime ends.
            let Ok(looked) = looked.await else { return };
            (known, seen) = looked;
        }
    }

    /// Rereads the files and logs the outcome.
    fn replace(&self) {
        match read_pair(&self.0.files) {
            Ok(pair) => {
                let until =
                    pair.validity.map_or_else(|| "unknown".to_owned(), |times| date(times.until));
                match pair.chain == self.pair().chain {
                    true => info!(
                        valid_until = until,
                        "the certificate was read again: it is unchanged"
                    ),
                    false => info!(
                        valid_until = until,
                        "the certificate was read again: it is a new one"
                    ),
                }
                *self.0.pair.write().unwrap_or_else(PoisonError::into_inner) = pair;
            }
            Err(error) => {
                error!(%error, "the certificate cannot be read again; the one of before stays in use");
            }
        }
    }

    fn pair(&self) -> LoadedPair {
        self.0.pair.read().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

fn read_pair(files: &[PathBuf; 2]) -> Result<LoadedPair, TlsError> {
    let [certificates, key] = files;
    // This is done before the files are read, so that a change in the meantime is noticed at the next check.
    let stamps = stamps(files);
    let chain = read_chain(certificates)
        .map_err(|found| TlsError::Certificates { file: certificates.clone(), found })?;
    let validity = chain.first().and_then(Validity::of);
    let secret = read_key(key).map_err(|found| TlsError::Key { file: key.clone(), found })?;
    let kept = chain.as_slice().into();
    let config = configured(chain, secret).map_err(|found| TlsError::Pair {
        certificates: certificates.clone(),
        key: key.clone(),
        found,
    })?;
    Ok(LoadedPair { config: Arc::new(config), chain: kept, validity, stamps })
}

fn stamps(files: &[PathBuf; 2]) -> Stamps {
    files.each_ref().map(|file| {
        let metadata = std::fs::metadata(file).ok()?;
        Some((metadata.len(), metadata.modified().ok()?))
    })
}

/// Year, month and day, UTC.
pub fn date(time: SystemTime) -> String {
    let unix_s = time.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let [year, month, day, ..] = calendar(unix_s);
    format!("{year}-{month:02}-{day:02}")
}

fn configured(
    chain: Vec<CertificateDer<'static>>,
    key: PrivateKeyDer<'static>,
) -> Result<ServerConfig, rustls::Error> {
    let mut config = ServerConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_protocol_versions(&[&version::TLS13])?
        .with_no_client_auth()
        .with_single_cert(chain, key)?;
    config.alpn_protocols = vec![b"http/1.1".to_vec()];
    Ok(config)
}

fn read_chain(file: &Path) -> Result<Vec<CertificateDer<'static>>, String> {
    let bytes = read(file)?;
    let chain: Result<Vec<_>, pem::Error> = CertificateDer::pem_slice_iter(&bytes).collect();
    match chain {
        Ok(chain) if chain.is_empty() => Err("no certificate".to_owned()),
        Ok(chain) => Ok(chain),
        Err(error) => Err(format!("no PEM ({error})")),
    }
}

fn read_key(file: &Path) -> Result<PrivateKeyDer<'static>, String> {
    PrivateKeyDer::from_pem_slice(&read(file)?).map_err(|error| match error {
        pem::Error::NoItemsFound => "no private key in the clear".to_owned(),
        error => format!("no PEM ({error})"),
    })
}

fn read(file: &Path) -> Result<Vec<u8>, String> {
    read_regular(file, limits::SETTINGS_FILE_BYTES_MAX)
        .map_err(|error| format!("no file to read ({error})"))
}

/// The first and last moments at which a certificate is valid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Validity {
    /// Before this time, the certificate is not valid.
    pub from: SystemTime,
    /// After this time, the certificate is not valid.
    pub until: SystemTime,
}

impl Validity {
    /// Reads a certificate's validity; `None` if rustls cannot read it.
    pub fn of(certificate: &CertificateDer) -> Option<Validity> {
        // rustls parses certificates, but reveals their validity only when it rejects one because of it. It checks the
        // validity before it looks for an issuer, and here the certificate has none.
        let rustls::Error::InvalidCertificate(CertificateError::NotValidYetContext {
            not_before,
            ..
        }) = rejection(certificate, 0)?
        else {
            return None;
        };
        let rustls::Error::InvalidCertificate(CertificateError::ExpiredContext {
            not_after, ..
        }) = rejection(certificate, u64::MAX)?
        else {
            return None;
        };
        Some(Validity { from: time_of(not_before), until: time_of(not_after) })
    }
}

/// The reason why a certificate is rejected at a given time, in seconds since 1970.
fn rejection(certificate: &CertificateDer, unix_s: u64) -> Option<rustls::Error> {
    let parsed = ParsedCertificate::try_from(certificate).ok()?;
    let now = UnixTime::since_unix_epoch(Duration::from_secs(unix_s));
    verify_server_cert_signed_by_trust_anchor(&parsed, &RootCertStore::empty(), &[], now, &[]).err()
}

fn time_of(time: UnixTime) -> SystemTime {
    UNIX_EPOCH + Duration::from_secs(time.as_secs())
}
