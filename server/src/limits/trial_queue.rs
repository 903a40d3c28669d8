//! A queue for processor-intensive work on behalf of strangers, such as verifying a run or trying a scene. Each trial
//! has its own low-priority thread. Trials run one after another, in an order that is fair between networks.
//!
//! **Order.** The next trial is the one whose network has waited longest since its last turn, comparing the widest
//! networks first; on a tie, the one that came first. So networks that submit one trial after another delay a newcomer
//! only by the current turn, however many of their trials are waiting.
//!
//! **Limits.** The number of trials is limited, in total and per address ([`shares`]). Once all places are taken, a
//! newcomer gets the place of a waiting trial from the network that has the most, if the newcomer's network has fewer
//! or has had no recent turn. An interruptible trial passes on its turn after [`TRIAL_TURN`]. A trial that cannot be
//! interrupted lets the next one start alongside it after [`TRIAL_TURN_MAX`], but only [`TRIALS_OVERDUE_MAX`] may be
//! overdue at once.

use crate::host::thread_time;
use crate::limits::networks::{LEVELS, networks, shares};
use crate::limits::{GUEST_NICENESS, TRACKED_ADDRESSES_MAX};
use std::collections::BTreeMap;
use std::io;
use std::net::IpAddr;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::oneshot;

/// Time after which an interruptible trial lets others have a turn. By then, most runs have been played.
const TRIAL_TURN: Duration = Duration::from_millis(500);
/// Time after which the next trial starts alongside one that is still running. By then, a scene's trial that has half
/// of a free processor is over, unless a single step takes longer.
const TRIAL_TURN_MAX: Duration = Duration::from_secs(1);
/// Maximum number of trials that may run alongside the one whose turn it is.
const TRIALS_OVERDUE_MAX: usize = 1;
/// How long a network's turn is remembered; longer than a full queue takes.
const TRIAL_TURNS_REMEMBERED: Duration = Duration::from_secs(60);

/// The queue for one kind of trial.
#[derive(Debug)]
pub struct TrialQueue {
    trials_max: usize,
    address_max: usize,
    turn: Duration,
    turn_max: Duration,
    state: Mutex<TrialQueueState>,
    /// Notified when a trial arrives, starts, passes on its turn or ends.
    changed: Condvar,
}

#[derive(Debug, Default)]
struct TrialQueueState {
    /// Waiting and running trials, in order of arrival.
    trials: Vec<QueuedTrial>,
    /// The newest trial's number.
    number: u64,
    /// Time at which each network last started a turn, narrowest networks first.
    turns: [BTreeMap<IpAddr, Instant>; LEVELS],
}

#[derive(Debug)]
struct QueuedTrial {
    number: u64,
    networks: [IpAddr; LEVELS],
    /// Start of the trial's turn; `None` while the trial is waiting.
    since: Option<Instant>,
}

/// A place in the queue, freed when dropped.
#[derive(Debug)]
pub struct QueuePlace {
    queue: Arc<TrialQueue>,
    number: u64,
}

impl TrialQueue {
    /// Creates an empty queue with `trials_max` places, of which one address may take `address_max`.
    pub fn new(trials_max: usize, address_max: usize) -> Arc<TrialQueue> {
        TrialQueue::with_turns(trials_max, address_max, TRIAL_TURN, TRIAL_TURN_MAX)
    }

    fn with_turns(
        trials_max: usize,
        address_max: usize,
        turn: Duration,
        turn_max: Duration,
    ) -> Arc<TrialQueue> {
        let (state, changed) = (Mutex::default(), Condvar::new());
        Arc::new(TrialQueue { trials_max, address_max, turn, turn_max, state, changed })
    }

    /// Runs `work` for a client of this address when its turn comes, on a thread with this name, and returns its
    /// result. `None` if no place was free, or the place was lost to another network. The work is completed even if the
    /// request is gone, and keeps its place until then. Errors are server errors.
    pub async fn run<T: Send + 'static>(
        self: &Arc<Self>,
        address: IpAddr,
        name: &str,
        work: impl FnOnce(&QueuePlace) -> T + Send + 'static,
    ) -> io::Result<Option<T>> {
        let Some(place) = self.enter(address) else { return Ok(None) };
        let (sender, done) = oneshot::channel();
        std::thread::Builder::new().name(name.to_owned()).spawn(move || {
            thread_time::go_after_others(GUEST_NICENESS);
            let result = place.wait().then(|| work(&place)).filter(|_| place.is_held());
            drop(place);
            // The request may already be gone.
            let _ = sender.send(result);
        })?;
        done.await.map_err(|_| io::Error::other("the work of a trial panicked"))
    }

    fn enter(self: &Arc<Self>, address: IpAddr) -> Option<QueuePlace> {
        let mut state = self.lock();
        let networks = networks(address);
        let held = (0..LEVELS).map(|level| state.held(level, networks[level]));
        if held.zip(shares(self.address_max)).any(|(held, share)| held >= share) {
            return None;
        }
        if state.trials.len() >= self.trials_max && !state.make_room(networks) {
            return None;
        }
        state.number += 1;
        let number = state.number;
        state.trials.push(QueuedTrial { number, networks, since: None });
        self.changed.notify_all();
        Some(QueuePlace { queue: Arc::clone(self), number })
    }

    fn lock(&self) -> MutexGuard<'_, TrialQueueState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl TrialQueueState {
    fn held(&self, level: usize, network: IpAddr) -> usize {
        self.trials.iter().filter(|trial| trial.networks[level] == network).count()
    }

    fn waiting(&self) -> impl Iterator<Item = &QueuedTrial> {
        self.trials.iter().filter(|trial| trial.since.is_none())
    }

    fn trial(&mut self, number: u64) -> Option<&mut QueuedTrial> {
        self.trials.iter_mut().find(|trial| trial.number == number)
    }

    /// Times at which these networks last started a turn, widest first.
    fn turns(&self, networks: [IpAddr; LEVELS]) -> [Option<Instant>; LEVELS] {
        std::array::from_fn(|at| LEVELS - 1 - at)
            .map(|level: usize| self.turns[level].get(&networks[level]).copied())
    }

    /// The trial that starts next.
    fn next(&self) -> Option<u64> {
        let order = |trial: &&QueuedTrial| (self.turns(trial.networks), trial.number);
        self.waiting().min_by_key(order).map(|trial| trial.number)
    }

    /// Time until another trial may start; `None` if one has to end first.
    fn free_in(&self, now: Instant, turn_max: Duration) -> Option<Duration> {
        let begun = self.trials.iter().filter_map(|trial| trial.since);
        match begun.clone().max() {
            None => Some(Duration::ZERO),
            Some(_) if begun.count() > TRIALS_OVERDUE_MAX => None,
            Some(newest) => Some((newest + turn_max).saturating_duration_since(now)),
        }
    }

    fn begin(&mut self, number: u64, now: Instant) {
        let Some(trial) = self.trial(number) else { return };
        trial.since = Some(now);
        let networks = trial.networks;
        for (turns, network) in self.turns.iter_mut().zip(networks) {
            turns.retain(|_, &mut at| now - at < TRIAL_TURNS_REMEMBERED);
            if turns.len() >= TRACKED_ADDRESSES_MAX {
                turns.clear();
            }
            turns.insert(network, now);
        }
    }

    /// Removes a waiting trial from the network that has the most, in favour of a newcomer whose network has fewer or
    /// has had no recent turn.
    fn make_room(&mut self, newcomer: [IpAddr; LEVELS]) -> bool {
        let claim = |networks: [IpAddr; LEVELS], more: usize| {
            let widest = networks[LEVELS - 1];
            (self.held(LEVELS - 1, widest) + more, self.turns[LEVELS - 1].contains_key(&widest))
        };
        let last = self.waiting().max_by_key(|trial| (claim(trial.networks, 0), trial.number));
        let Some(last) = last.filter(|last| claim(last.networks, 0) > claim(newcomer, 1)) else {
            return false;
        };
        let number = last.number;
        self.trials.retain(|trial| trial.number != number);
        true
    }
}

impl QueuePlace {
    /// Waits for this place's turn; returns `false` if the place was lost to another network.
    fn wait(&self) -> bool {
        let mut state = self.queue.lock();
        loop {
            if state.trial(self.number).is_none() {
                return false;
            }
            let now = Instant::now();
            let free_in = state.free_in(now, self.queue.turn_max);
            if free_in == Some(Duration::ZERO) && state.next() == Some(self.number) {
                state.begin(self.number, now);
                // Wakes the others, which then wait for this turn to become overdue.
                self.queue.changed.notify_all();
                return true;
            }
            state = match free_in.filter(|time| !time.is_zero()) {
                Some(time) => {
                    let waited = self.queue.changed.wait_timeout(state, time);
                    waited.unwrap_or_else(PoisonError::into_inner).0
                }
                None => self.queue.changed.wait(state).unwrap_or_else(PoisonError::into_inner),
            };
        }
    }

    /// Called regularly by interruptible work. If the turn has lasted its full time and others are waiting, passes the
    /// turn on and waits for the next one. Returns `false` if the place was lost in the meantime and the work should
    /// stop.
    pub fn pass(&self) -> bool {
        let mut state = self.queue.lock();
        let is_awaited = state.waiting().next().is_some();
        let Some(trial) = state.trial(self.number) else { return false };
        let is_over = trial.since.is_none_or(|since| since.elapsed() >= self.queue.turn);
        if !(is_awaited && is_over) {
            return true;
        }
        trial.since = None;
        self.queue.changed.notify_all();
        drop(state);
        self.wait()
    }

    fn is_held(&self) -> bool {
        self.queue.lock().trial(self.number).is_some()
    }
}

impl Drop for QueuePlace {
    fn drop(&mut self) {
        let mut state = self.queue.lock();
        state.trials.retain(|trial| trial.number != self.number);
        self.queue.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc;
    use std::thread::yield_now;

    /// Longer than anything takes, even on a busy machine.
    const LONG: Duration = Duration::from_secs(300);

    /// An address on this line.
    fn line(number: u8) -> IpAddr {
        IpAddr::from([198, 51, number, 1])
    }

    /// Enters trials from these lines, each from a different address.
    fn entered(queue: &Arc<TrialQueue>, lines: &[u8]) -> Vec<QueuePlace> {
        let address = |(at, &line): (usize, &u8)| IpAddr::from([198, 51, line, at as u8]);
        lines.iter().enumerate().filter_map(|entry| queue.enter(address(entry))).collect()
    }

    /// Plays all trials, each in one turn, and returns the order in which they were played.
    fn played(queue: &Arc<TrialQueue>, mut places: Vec<QueuePlace>) -> Vec<u64> {
        let mut order = Vec::new();
        let next = || queue.lock().next();
        while let Some(number) = next() {
            queue.lock().begin(number, Instant::now());
            places.retain(|place| place.number != number);
            order.push(number);
        }
        order
    }

    #[test]
    fn networks_take_turns_and_a_newcomer_is_next() {
        let queue = TrialQueue::new(16, 4);
        let places = entered(&queue, &[1, 1, 1, 2, 2, 3]);
        assert_eq!(played(&queue, places), [1, 4, 6, 2, 5, 3]);
        let places = entered(&queue, &[1, 2, 3, 1, 4]);
        assert_eq!(played(&queue, places), [11, 9, 8, 10, 7], "the last turn was of 1");
    }

    #[test]
    fn an_address_has_few_places_and_a_line_twice_as_many() {
        let queue = TrialQueue::new(16, 2);
        let of_address: Vec<_> = (0..9).filter_map(|_| queue.enter(line(1))).collect();
        let of_line = entered(&queue, &[1; 9]);
        assert_eq!((of_address.len(), of_line.len()), (2, 2));
        drop(of_address);
        assert!(queue.enter(line(1)).is_some());
    }

    #[test]
    fn a_full_queue_sends_away_the_network_that_has_most_or_had_a_turn() {
        let queue = TrialQueue::new(4, 4);
        let places = entered(&queue, &[1, 1, 1, 2]);
        assert!(queue.enter(line(1)).is_none(), "it has most itself");
        let newcomer = queue.enter(line(3)).expect("a place");
        let held: Vec<_> = places.iter().map(QueuePlace::is_held).collect();
        assert_eq!(held, [true, true, false, true]);
        assert!(!places[2].wait(), "it learns of it");
        drop((places, newcomer));

        let places = entered(&queue, &[4, 5, 6, 7]);
        assert!(queue.enter(line(8)).is_none(), "all have one, and came before");
        played(&queue, places);
        let places = entered(&queue, &[4, 5, 6, 7]);
        assert!(queue.enter(line(4)).is_none());
        assert!(queue.enter(line(8)).is_some(), "the others had a turn");
        assert!(!places[3].is_held());
    }

    #[tokio::test]
    async fn the_next_trial_begins_beside_one_that_is_overdue_and_no_third() {
        let queue = TrialQueue::with_turns(9, 2, Duration::ZERO, Duration::ZERO);
        let (ends, end) = mpsc::channel::<()>();
        let stuck = Arc::clone(&queue);
        let stuck = tokio::spawn(async move {
            let work = move |_: &QueuePlace| end.recv_timeout(LONG).is_ok();
            stuck.run(line(1), "stuck", work).await
        });
        while queue.lock().turns[0].is_empty() {
            tokio::task::yield_now().await;
        }
        let inner = Arc::clone(&queue);
        let may_another =
            move |_: &QueuePlace| inner.lock().free_in(Instant::now(), Duration::ZERO);
        let beside = queue.run(line(2), "beside", may_another).await;
        assert_eq!(beside.expect("no error"), Some(None), "none beside these two");
        ends.send(()).expect("it waits");
        assert_eq!(stuck.await.expect("no panic").expect("no error"), Some(true));
    }

    #[tokio::test]
    async fn a_long_trial_lets_a_short_one_have_its_turn() {
        let queue = TrialQueue::with_turns(9, 2, Duration::ZERO, LONG);
        let (sender, short) = mpsc::channel();
        let inner = Arc::clone(&queue);
        let long = queue.run(line(1), "long", move |place| {
            while inner.lock().trials.len() < 2 {
                yield_now();
            }
            place.pass() && short.try_recv().is_ok()
        });
        let short = queue.run(line(2), "short", move |_| sender.send(()));
        let (long, short) = tokio::join!(long, short);
        assert_eq!(long.expect("no error"), Some(true), "it was played meanwhile");
        assert!(short.expect("no error").is_some());
    }

    #[tokio::test]
    async fn work_has_its_place_until_it_ends_although_the_request_is_gone() {
        let queue = TrialQueue::new(9, 1);
        let (sender, worked) = mpsc::channel();
        let (ends, end) = mpsc::channel::<()>();
        let work = queue.run(line(1), "trial", move |_| {
            let ended = end.recv_timeout(LONG);
            sender.send(ended).expect("it is awaited");
        });
        // The future is polled once, which starts the thread, and then dropped.
        assert!(tokio::time::timeout(Duration::ZERO, work).await.is_err(), "it takes a moment");
        assert!(queue.enter(line(1)).is_none(), "it has its place");
        ends.send(()).expect("it waits");
        assert!(worked.recv_timeout(LONG).expect("the work ends").is_ok());
    }
}
