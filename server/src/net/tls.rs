//! TLS on the players' port: reads the certificates and the key, and does the handshake. TLS 1.3 only,
//! which every browser that can draw the page speaks, and HTTP/1.1 only, which carries the WebSockets.

use crate::limits;
use crate::net::maybe_tls_stream::{MaybeTlsStream, Socket};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::crypto::ring;
use tokio_rustls::rustls::pki_types::pem::{self, PemObject};
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
use tokio_rustls::rustls::{self, ServerConfig, version};

/// The server's certificates and key. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Tls(Arc<ServerConfig>);

/// Error of [`Tls::read`].
#[derive(Debug, thiserror::Error)]
pub enum TlsError {
    /// The certificates cannot be read.
    #[error(
        "--tls-cert {}: found {found}; allowed: a PEM file with one CERTIFICATE or more, the server's \
         own first", file.display()
    )]
    Certificates {
        /// The file that was to hold them.
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
        /// The file that was to hold it.
        file: PathBuf,
        /// A description of what was found.
        found: String,
    },
    /// Each can be read, but they do not belong together.
    #[error(
        "--tls-cert {} with --tls-key {}: found {found}; allowed: the key of the first certificate, \
         Ed25519, ECDSA or RSA", certificates.display(), key.display()
    )]
    Pair {
        /// The file of the certificates.
        certificates: PathBuf,
        /// The file of the key.
        key: PathBuf,
        /// The mismatch.
        found: rustls::Error,
    },
}

impl Tls {
    /// Reads two PEM files, and checks that the key is the first certificate's.
    pub fn read(certificates: &Path, key: &Path) -> Result<Tls, TlsError> {
        let chain = read_chain(certificates)
            .map_err(|found| TlsError::Certificates { file: certificates.to_owned(), found })?;
        let secret =
            read_key(key).map_err(|found| TlsError::Key { file: key.to_owned(), found })?;
        configured(chain, secret).map_err(|found| TlsError::Pair {
            certificates: certificates.to_owned(),
            key: key.to_owned(),
            found,
        })
    }

    /// Does the handshake, without a time limit of its own. A protocol error of the peer is
    /// [`io::ErrorKind::InvalidData`]; other errors are those of the socket.
    pub async fn accept(&self, stream: Socket) -> io::Result<MaybeTlsStream> {
        let mut stream = TlsAcceptor::from(Arc::clone(&self.0)).accept(stream).await?;
        stream.get_mut().1.set_buffer_limit(Some(limits::TLS_BUFFER_BYTES_MAX));
        Ok(MaybeTlsStream::Right(Box::new(stream)))
    }
}

fn configured(
    chain: Vec<CertificateDer<'static>>,
    key: PrivateKeyDer<'static>,
) -> Result<Tls, rustls::Error> {
    let mut config = ServerConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_protocol_versions(&[&version::TLS13])?
        .with_no_client_auth()
        .with_single_cert(chain, key)?;
    config.alpn_protocols = vec![b"http/1.1".to_vec()];
    Ok(Tls(Arc::new(config)))
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
    std::fs::read(file).map_err(|error| format!("no file to read ({error})"))
}
