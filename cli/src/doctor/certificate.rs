//! The certificate's validity.

use super::finding::Finding;
use jostle_server::net::tls::Validity;
use jostle_server::net::tls::date;
use std::time::{Duration, SystemTime};

/// A renewal is late if less than this fraction (a quarter) of a certificate's lifetime is left; issuers recommend
/// renewal at a third.
const LEFT_SHARE: u32 = 4;
/// For certificates that last for years, a renewal is also late if less than this is left.
const LEFT_MAX: Duration = Duration::from_secs(14 * 24 * 60 * 60);
/// A renewal is always late if less than this is left.
const LEFT_MIN: Duration = Duration::from_secs(24 * 60 * 60);

/// Judges a server's certificate; `None` if its validity cannot be read.
pub fn judge(validity: Option<Validity>, now: SystemTime) -> Finding {
    let about = "certificate";
    let Some(Validity { from, until }) = validity else {
        return Finding::change(about, "its times cannot be read", "have it issued again");
    };
    let life = until.duration_since(from).unwrap_or_default();
    let (first, last) = (date(from), date(until));
    let Ok(left) = until.duration_since(now) else {
        return Finding::change(about, format!("it ended on {last}"), "renew it");
    };
    if now < from {
        let change = "wait, or set this machine's clock";
        return Finding::change(about, format!("it begins on {first}"), change);
    }
    let days = left.as_secs() / (24 * 60 * 60);
    let is_fine = left >= LEFT_MAX.min(life / LEFT_SHARE).max(LEFT_MIN);
    let change = "see why it was not renewed; the server takes up a new file by itself";
    Finding::judged(about, format!("it ends on {last}, in {days} days"), is_fine, change)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::UNIX_EPOCH;

    #[test]
    fn a_late_renewal_is_found() {
        let day = |day: u64| UNIX_EPOCH + Duration::from_secs(day * 24 * 60 * 60);
        let of = |life: u64, at: u64| {
            judge(Some(Validity { from: day(1000), until: day(1000 + life) }), day(1000 + at))
        };
        for (life, last_fine) in [(90, 76), (6, 4), (3650, 3636), (47, 35)] {
            assert!(of(life, last_fine).is_fine(), "{life}");
            assert!(!of(life, last_fine + 1).is_fine(), "{life}");
        }
        let half = Duration::from_secs(12 * 60 * 60);
        let today = Validity { from: day(1000), until: day(1000) + half };
        assert!(!judge(Some(today), day(1000)).is_fine(), "it ends today");
        assert_eq!(of(90, 0).found, "it ends on 1972-12-26, in 90 days");
        assert_eq!(of(90, 91).change.as_deref(), Some("renew it"));
        let early = judge(Some(Validity { from: day(2), until: day(92) }), day(1));
        assert!(!early.is_fine() && early.found == "it begins on 1970-01-03", "{early}");
        assert!(!judge(None, day(0)).is_fine());
    }
}
