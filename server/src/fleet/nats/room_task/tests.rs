//! Runs a room's task against a stream whose network the test controls.

use super::*;
use crate::log::{Policy, STATE, SharedLog};
use std::sync::atomic::AtomicU32;
use std::sync::{Mutex, PoisonError};
use tokio::sync::mpsc;

const CODE: &str = "k7f3q2";
/// Number of the first message sent by the task.
const FIRST_WRITER: u64 = 100;
/// The message with which the node took over the room.
const TAKEN_OVER: Kept = Kept { sequence: 1, writer: FIRST_WRITER - 1, epoch: 1 };

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Kept {
    sequence: Sequence,
    writer: u64,
    epoch: u64,
}

/// A request to the stream.
#[derive(Clone, Copy, Debug)]
enum Request {
    Write { writer: u64, epoch: u64, last: Sequence },
    Purge { before: Sequence },
}

/// A stream with one room's messages. While it is cut off, the connection holds all requests, and no answers arrive.
#[derive(Clone, Default)]
struct Stream {
    state: Arc<Mutex<State>>,
}

#[derive(Default)]
struct State {
    kept: Vec<Kept>,
    sequences: Sequence,
    is_cut_off: bool,
    /// Whether the next purge cuts the stream off.
    falls_silent: bool,
    waiting: Vec<Request>,
}

impl State {
    fn last(&self) -> Tail {
        let tail = |kept: &Kept| Tail {
            sequence: kept.sequence,
            writer: Some(kept.writer),
            epoch: kept.epoch,
        };
        self.kept.last().map_or(Tail::default(), tail)
    }

    fn carry_out(&mut self, request: Request) -> Published {
        match request {
            Request::Write { last, .. } if last != self.last().sequence => Published::Refused,
            Request::Write { writer, epoch, .. } => {
                self.sequences += 1;
                self.kept.push(Kept { sequence: self.sequences, writer, epoch });
                Published::Done(self.sequences)
            }
            Request::Purge { before } => {
                self.kept.retain(|kept| kept.sequence >= before);
                Published::Done(self.sequences)
            }
        }
    }

    fn take(&mut self, request: Request) -> Published {
        if let Request::Purge { .. } = request {
            self.is_cut_off |= std::mem::take(&mut self.falls_silent);
        }
        if self.is_cut_off {
            self.waiting.push(request);
            return Published::Unknown("cut off".to_owned());
        }
        self.carry_out(request)
    }
}

impl Stream {
    fn new() -> Stream {
        let stream = Stream::default();
        stream.with(|state| {
            (state.kept, state.sequences) = (vec![TAKEN_OVER], TAKEN_OVER.sequence);
        });
        stream
    }

    fn with<R>(&self, change: impl FnOnce(&mut State) -> R) -> R {
        change(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn cut_off(&self) {
        self.with(|state| state.is_cut_off = true);
    }

    /// Re-establishes the connection and delivers the requests that it held. In `before`, another node may write first.
    fn comes_back(&self, before: impl FnOnce(&mut State)) {
        self.with(|state| {
            state.is_cut_off = false;
            before(state);
            for request in std::mem::take(&mut state.waiting) {
                state.carry_out(request);
            }
        });
    }

    fn kept(&self) -> Vec<Kept> {
        self.with(|state| state.kept.clone())
    }
}

impl RecordStream for Stream {
    async fn publish(&self, _: &str, message: &Message, last: Sequence) -> Published {
        let Message { writer, epoch, .. } = *message;
        self.with(|state| state.take(Request::Write { writer, epoch, last }))
    }

    async fn tail(&self, _: &str) -> Result<Tail, String> {
        self.with(|state| match state.is_cut_off {
            true => Err("cut off".to_owned()),
            false => Ok(state.last()),
        })
    }

    async fn purge(&self, _: &str, before: Sequence) -> Result<(), String> {
        match self.with(|state| state.take(Request::Purge { before })) {
            Published::Unknown(reason) => Err(reason),
            _ => Ok(()),
        }
    }
}

/// A room's task, running alongside the test.
struct Room {
    work: mpsc::UnboundedSender<NextWrite>,
    /// Number of files that were given up.
    failed: Arc<AtomicU32>,
    outcomes: mpsc::UnboundedReceiver<RoomOutcome>,
    shared: Arc<RoomTaskContext>,
    task: tokio::task::JoinHandle<()>,
}

impl Room {
    fn begin(stream: &Stream) -> Room {
        let (sender, outcomes) = mpsc::unbounded_channel();
        let report = move |code: &str, outcome| {
            assert_eq!(code, CODE);
            sender.send(outcome).expect("the test listens");
        };
        let shared = Arc::new(RoomTaskContext::new(FIRST_WRITER, report));
        let stream = stream.clone();
        let mut task = RoomTask::new(Arc::clone(&shared), stream, CODE, 1, TAKEN_OVER.sequence);
        let (work, mut receiver) = mpsc::unbounded_channel();
        let failed = Arc::new(AtomicU32::new(0));
        let failures = Arc::clone(&failed);
        let task = tokio::spawn(async move {
            while let Some(next) = receiver.recv().await {
                let done = task.carry_out(&next).await;
                failures.fetch_add(u32::from(!done), Ordering::Relaxed);
            }
        });
        Room { work, failed, outcomes, shared, task }
    }

    fn does(&self, next: NextWrite) {
        self.work.send(next).expect("a task");
    }

    /// Waits until the task has given up on a file.
    async fn gives_up(&self) {
        until(|| self.failed.load(Ordering::Relaxed) > 0).await;
    }

    /// Ends the room's thread, waits for the task, and returns what it reported.
    async fn ends(mut self) -> Vec<RoomOutcome> {
        drop(self.work);
        self.task.await.expect("a task without a panic");
        drop(self.shared);
        let mut outcomes = Vec::new();
        while let Some(outcome) = self.outcomes.recv().await {
            outcomes.push(outcome);
        }
        outcomes
    }
}

/// Waits until a condition holds. In these tests, the clock advances only while all tasks are waiting.
async fn until(is_so: impl Fn() -> bool) {
    while !is_so() {
        sleep(RETRY / 10).await;
    }
}

#[tokio::test(start_paused = true)]
async fn a_message_that_was_given_up_and_arrives_late_is_its_own() {
    let stream = Stream::new();
    let room = Room::begin(&stream);
    room.does(NextWrite::Begin(Vec::new()));
    until(|| stream.kept().iter().any(|kept| kept.writer == FIRST_WRITER)).await;

    stream.cut_off();
    room.does(NextWrite::Append(Vec::new()));
    room.gives_up().await;
    stream.comes_back(|_| {});
    let late = stream.kept().last().map(|kept| kept.writer);
    assert_eq!(late, Some(FIRST_WRITER + 1));

    room.does(NextWrite::Begin(Vec::new()));
    room.does(NextWrite::Seal(Seal::Keep));
    assert_eq!(room.ends().await, [RoomOutcome::Parted]);
    assert_eq!(stream.kept().last().map(|kept| kept.writer), Some(FIRST_WRITER + 2));
}

#[tokio::test(start_paused = true)]
async fn a_message_of_another_node_shuts_the_task_out() {
    let stream = Stream::new();
    let room = Room::begin(&stream);
    stream.cut_off();
    room.does(NextWrite::Begin(Vec::new()));
    room.gives_up().await;
    let other = Kept { sequence: 2, writer: 7, epoch: 2 };
    stream.comes_back(|state| {
        state.carry_out(Request::Write { writer: 7, epoch: 2, last: TAKEN_OVER.sequence });
    });
    room.does(NextWrite::Begin(Vec::new()));
    assert_eq!(room.ends().await, [RoomOutcome::Fenced]);
    assert_eq!(stream.kept(), [TAKEN_OVER, other]);
}

#[tokio::test(start_paused = true)]
async fn a_room_has_ended_once_its_records_are_gone() {
    let stream = Stream::new();
    let mut room = Room::begin(&stream);
    room.does(NextWrite::Begin(Vec::new()));
    until(|| stream.kept().len() == 1).await;
    stream.cut_off();
    room.does(NextWrite::Seal(Seal::Remove));
    sleep(20 * RETRY).await;
    assert!(room.outcomes.try_recv().is_err());
    stream.comes_back(|_| {});
    assert_eq!(room.ends().await, [RoomOutcome::Ended]);
    assert_eq!(stream.kept(), []);
}

#[tokio::test(start_paused = true)]
async fn a_removal_that_arrives_late_leaves_the_records_of_the_next_node() {
    let stream = Stream::new();
    let room = Room::begin(&stream);
    stream.with(|state| state.falls_silent = true);
    room.does(NextWrite::Seal(Seal::Remove));
    until(|| stream.with(|state| !state.waiting.is_empty())).await;
    let other = Kept { sequence: 2, writer: 7, epoch: 2 };
    stream.comes_back(|state| {
        state.carry_out(Request::Write { writer: 7, epoch: 2, last: TAKEN_OVER.sequence });
    });
    assert_eq!(room.ends().await, [RoomOutcome::Fenced]);
    assert_eq!(stream.kept(), [other]);
}

#[tokio::test(start_paused = true)]
async fn records_that_the_stream_has_forgotten_are_written_again() {
    for forgotten in [Vec::new(), vec![TAKEN_OVER]] {
        let stream = Stream::new();
        let room = Room::begin(&stream);
        room.does(NextWrite::Begin(Vec::new()));
        until(|| stream.kept().len() == 1 && stream.kept()[0] != TAKEN_OVER).await;
        stream.with(|state| {
            state.sequences = forgotten.last().map_or(0, |kept| kept.sequence);
            state.kept = forgotten;
        });
        room.does(NextWrite::Append(Vec::new()));
        room.gives_up().await;
        room.does(NextWrite::Begin(Vec::new()));
        room.does(NextWrite::Seal(Seal::Keep));
        assert_eq!(room.ends().await, [RoomOutcome::Parted]);
        assert_eq!(stream.kept().last().map(|kept| kept.writer), Some(FIRST_WRITER + 2));
    }
}

#[tokio::test(start_paused = true)]
async fn a_stream_that_stalls_gets_a_new_file_once_it_answers() {
    let scene = jostle_game::Scene::built_in().swap_remove(0);
    let mut room = jostle_room::Room::new(CODE, Arc::new(scene), 5);
    room.keep_clips("test");
    let (shared, policy) =
        (Arc::<SharedLog>::default(), Policy::new("CANNOT", limits::STATE_RETRY));
    let mut plays = |ticks: u32| {
        (0..ticks).for_each(|_| room.tick());
        shared.publish(room.log().expect("it is kept").blocks().clone(), true);
    };
    let stream = Stream::new();
    let (writers, report) = (RoomTaskContext::new(FIRST_WRITER, |_, _| {}), TAKEN_OVER.sequence);
    let task = RoomTask::new(Arc::new(writers), stream.clone(), CODE, 1, report);
    let task = tokio::spawn(task.run(LogReader::new(&shared, &policy, STATE)));
    plays(30);
    until(|| stream.kept().iter().any(|kept| kept.writer >= FIRST_WRITER)).await;
    stream.cut_off();
    plays(30);
    until(|| policy.errors() == 1).await;
    stream.comes_back(|_| {});
    let late = stream.kept().len();
    plays(60);
    until(|| stream.kept().len() > late || stream.kept()[0].writer > FIRST_WRITER + 1).await;
    assert_eq!(policy.errors(), 1);
    shared.seal(Seal::Remove);
    task.await.expect("a task without a panic");
    assert_eq!(stream.kept(), []);
}
