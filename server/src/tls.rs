//! TLS on the players' port: reads the certificates and the key, and shakes hands. TLS 1.3 only,
//! which every browser that can draw the page speaks, and HTTP/1.1 only, which carries the sockets.

use crate::stream::Stream;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tokio::net::TcpStream;
use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::crypto::ring;
use tokio_rustls::rustls::pki_types::pem::{self, PemObject};
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
use tokio_rustls::rustls::{self, ServerConfig, version};

/// What the server shows of itself, and proves. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Tls(Arc<ServerConfig>);

/// Why a server cannot serve under TLS.
#[derive(Debug, thiserror::Error)]
pub enum TlsError {
    /// No certificates.
    #[error(
        "--tls-cert {}: found {found}; allowed: a PEM file with one CERTIFICATE or more, the server's \
         own first", file.display()
    )]
    Certificates {
        /// Where they should have been.
        file: PathBuf,
        /// What was there.
        found: String,
    },
    /// No key.
    #[error(
        "--tls-key {}: found {found}; allowed: a PEM file with a PRIVATE KEY, EC PRIVATE KEY or RSA \
         PRIVATE KEY, not encrypted", file.display()
    )]
    Key {
        /// Where it should have been.
        file: PathBuf,
        /// What was there.
        found: String,
    },
    /// Each can be read, but they cannot be used together.
    #[error(
        "--tls-cert {} with --tls-key {}: found {found}; allowed: the key of the first certificate, \
         Ed25519, ECDSA or RSA", certificates.display(), key.display()
    )]
    Pair {
        /// The file of the certificates.
        certificates: PathBuf,
        /// The file of the key.
        key: PathBuf,
        /// What does not fit.
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

    /// Shakes hands, for as long as the peer takes: the caller sets the time. What the peer says wrong
    /// is [`io::ErrorKind::InvalidData`]; other errors are those of the socket.
    pub async fn accept(&self, stream: TcpStream) -> io::Result<Stream> {
        let stream = TlsAcceptor::from(Arc::clone(&self.0)).accept(stream).await?;
        Ok(Stream::Tls(Box::new(stream)))
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
