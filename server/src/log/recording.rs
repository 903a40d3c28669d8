//! A server's recordings: writers for rooms' files, and clips.

use super::store::ReplayStore;
use super::writer::LogWriter;
use crate::host::random;
use crate::limits;
use crate::limits::address_rate_limiter::AddressRateLimiter;
use crate::limits::networks::widest;
use jostle_protocol::ClipRefusal;
use jostle_protocol::replay::{Record, Replay, Start, header};
use jostle_room::log::{CLIP_TICKS, cut};
use std::io;
use std::net::IpAddr;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant, UNIX_EPOCH};

/// Maximum number of clips per minute from one address, across all rooms. It is as many as in one room, which is enough
/// for a class playing together.
const ADDRESS_CLIPS_PER_MINUTE_MAX: u32 = 8;

/// A server's recordings, as its rooms see them.
pub struct Recording {
    store: Arc<ReplayStore>,
    writer: Arc<LogWriter>,
    /// Number of clips that are waiting or being cut.
    waiting_clips: Arc<AtomicUsize>,
    /// Limits the rate of clips from each address.
    clip_rates: Mutex<AddressRateLimiter>,
}

/// The rate limit for clips from each address, across all rooms of a server.
pub(super) fn clip_rates() -> AddressRateLimiter {
    let per_second = f64::from(ADDRESS_CLIPS_PER_MINUTE_MAX) / 60.0;
    AddressRateLimiter::new(per_second, ADDRESS_CLIPS_PER_MINUTE_MAX as usize)
}

impl Recording {
    /// Creates recordings that use this writer.
    pub fn new(store: Arc<ReplayStore>, writer: Arc<LogWriter>) -> Recording {
        let (waiting_clips, clip_rates) = (Arc::default(), Mutex::new(clip_rates()));
        Recording { store, writer, waiting_clips, clip_rates }
    }

    pub fn store(&self) -> &Arc<ReplayStore> {
        &self.store
    }

    /// The current time, in seconds since 1970.
    pub fn unix_s(&self) -> u64 {
        let wall = (self.store.settings().wall)();
        wall.duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO).as_secs()
    }

    /// Counts a clip requested by a client at this address; returns `false` if the address has requested too many
    /// across all rooms.
    pub fn admit_clip(&self, address: IpAddr, now: Instant) -> bool {
        self.clip_rates.lock().unwrap_or_else(PoisonError::into_inner).admit(address, now)
    }

    /// Cuts a clip from these records and saves it. The answer comes from the writer's thread, or immediately if that
    /// is too busy. An unlisted clip belongs to a private room. Its name and its file do not reveal the room's code,
    /// which would let in anyone who sees it.
    pub fn keep_clip(
        &self,
        mut records: Vec<Arc<Record>>,
        listed: bool,
        asked_by: Option<IpAddr>,
        answer: impl Fn(Result<String, ClipRefusal>) + Clone + Send + 'static,
    ) {
        let waiting = Arc::clone(&self.waiting_clips);
        if waiting.fetch_add(1, Ordering::Relaxed) >= limits::CLIPS_WAITING_MAX {
            waiting.fetch_sub(1, Ordering::Relaxed);
            return answer(Err(ClipRefusal::TooMany));
        }
        let answer = move |kept| {
            waiting.fetch_sub(1, Ordering::Relaxed);
            answer(kept);
        };
        if let Some(Record::Start(start)) =
            records.first_mut().filter(|_| !listed).map(Arc::make_mut)
        {
            start.room = format!("{:016x}", random());
        }
        let (store, asked_by) = (Arc::clone(&self.store), asked_by.map(widest));
        let answer_kept = answer.clone();
        let queued = self.writer.once(move || {
            let kept = clip(&records)
                .and_then(|(start, bytes)| store.keep_clip(&start, listed, asked_by, &bytes));
            answer_kept(kept.map_err(|error| {
                store.policy().failed(&error);
                ClipRefusal::Failed
            }));
        });
        if !queued {
            answer(Err(ClipRefusal::Failed));
        }
    }
}

/// A clip's start record and its bytes, which contain a replay's last ticks.
fn clip(records: &[Arc<Record>]) -> io::Result<(Start, Vec<u8>)> {
    let bytes = header().into_iter().chain(records.iter().flat_map(|record| record.seal()));
    let replay = Replay::read(bytes.collect()).map_err(io::Error::other)?;
    let (start, to) = (replay.start().clone(), replay.last_tick());
    let clip = cut(replay, to.saturating_sub(CLIP_TICKS), to).map_err(io::Error::other)?;
    Ok((start, clip))
}
