//! The time for which a certificate is valid.

use std::time::{Duration, SystemTime, UNIX_EPOCH};
use tokio_rustls::rustls::client::verify_server_cert_signed_by_trust_anchor;
use tokio_rustls::rustls::pki_types::{CertificateDer, UnixTime};
use tokio_rustls::rustls::server::ParsedCertificate;
use tokio_rustls::rustls::{CertificateError, Error, RootCertStore};

/// First and last moment of a certificate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Validity {
    /// It is not valid before.
    pub from: SystemTime,
    /// It is not valid after.
    pub until: SystemTime,
}

impl Validity {
    /// Reads that of a certificate; `None` if it has none that rustls can read.
    pub fn of(certificate: &CertificateDer) -> Option<Validity> {
        // rustls parses certificates, but tells their times only where it rejects one for them. It looks at
        // them before it looks for an issuer, of which there is none here.
        let Error::InvalidCertificate(CertificateError::NotValidYetContext { not_before, .. }) =
            rejection(certificate, 0)?
        else {
            return None;
        };
        let Error::InvalidCertificate(CertificateError::ExpiredContext { not_after, .. }) =
            rejection(certificate, u64::MAX)?
        else {
            return None;
        };
        Some(Validity { from: time(not_before), until: time(not_after) })
    }
}

/// The reason why a certificate is rejected at a time, seconds since 1970.
fn rejection(certificate: &CertificateDer, unix_s: u64) -> Option<Error> {
    let parsed = ParsedCertificate::try_from(certificate).ok()?;
    let now = UnixTime::since_unix_epoch(Duration::from_secs(unix_s));
    verify_server_cert_signed_by_trust_anchor(&parsed, &RootCertStore::empty(), &[], now, &[]).err()
}

fn time(time: UnixTime) -> SystemTime {
    UNIX_EPOCH + Duration::from_secs(time.as_secs())
}
