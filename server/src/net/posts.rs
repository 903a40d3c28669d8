//! Game sessions over HTTP, for clients whose network lets no WebSocket through. A streamed response carries the bytes
//! that the server would send over a WebSocket, and the bodies of short requests, the posts, carry the client's.
//!
//! A session needs a reader and a writer of bytes, whatever carries them. Here the reader is a [`PostReader`], and the
//! writer is the connection of the streamed response, after its head. Everything above is shared with WebSockets:
//! frames, limits on messages and times, backpressure, and how a session ends.
//!
//! - **Data**: [`PostStreams`] finds a session's [`PostQueue`] by its id, 128 random bits that only the client knows.
//!   The queue has the number of the next post and the bodies that the session has not read yet. It is listed for as
//!   long as its [`Posts`] exist, which belong to the session.
//! - **A trip**: `POST /api/stream/CODE` is answered with the id and then with the server's frames, until the session
//!   ends; its connection becomes the session's, on the same thread. `POST /api/send/ID/NUMBER` carries frames of the
//!   client. It may come over any connection, on any thread and from any address, as those of a private relay change.
//!   Posts are numbered from 0. One that was already taken is answered like the first time and ignored, so a client can
//!   repeat a post whose answer it missed; one that leaves a gap is refused.
//! - **Limits**: a post has at most [`POST_BYTES_MAX`](jostle_protocol::limits::POST_BYTES_MAX) bytes; [`POSTS_WAITING_MAX`] of them wait for a session. Posts
//!   do not count as requests of an address, because a session may send as many as messages; beyond that they are
//!   refused. The address that opened the stream is the session's.

use crate::limits::token_bucket::TokenBucket;
use crate::limits::{MESSAGES_BURST_MAX, MESSAGES_PER_SECOND_MAX};
use crate::net::maybe_tls_stream::FromPeer;
use bytes::Bytes;
use std::collections::BTreeMap;
use std::io::{self, ErrorKind};
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, ready};
use std::time::Instant;
use tokio::io::{AsyncRead, ReadBuf};
use tokio::sync::mpsc;

/// Maximum number of posts that wait for a session. It reads each at once; a client sends the next one after the
/// answer.
const POSTS_WAITING_MAX: usize = 2;

/// The queues of all sessions over HTTP, by the sessions' ids.
#[derive(Default)]
pub struct PostStreams(Mutex<BTreeMap<u128, Arc<PostQueue>>>);

/// The way from a client's posts to its session.
pub struct PostQueue {
    bodies: mpsc::Sender<Bytes>,
    state: Mutex<PostState>,
}

struct PostState {
    /// The number of the next post.
    next: u32,
    rate: TokenBucket,
}

/// The reason why a post was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PostError {
    /// Posts before this one are missing.
    Gap,
    /// Too many posts are waiting for the session.
    Full,
    /// The session has ended.
    Ended,
}

impl PostStreams {
    /// Lists a new session under a random id.
    pub fn open(self: &Arc<Self>, id: u128) -> Posts {
        let (sender, bodies) = mpsc::channel(POSTS_WAITING_MAX);
        let (rate, burst) = (MESSAGES_PER_SECOND_MAX, MESSAGES_BURST_MAX);
        let rate = TokenBucket::new(rate, burst, Instant::now());
        let state = Mutex::new(PostState { next: 0, rate });
        lock(&self.0).insert(id, Arc::new(PostQueue { bodies: sender, state }));
        Posts { id, bodies, streams: Arc::clone(self) }
    }

    pub fn find(&self, id: u128) -> Option<Arc<PostQueue>> {
        lock(&self.0).get(&id).cloned()
    }
}

impl PostQueue {
    /// Counts a post. Returns whether the session may send one more now.
    pub fn admit(&self, now: Instant) -> bool {
        lock(&self.state).rate.take(now)
    }

    /// Queues the body of the post with this number, unless it was already taken.
    pub fn push(&self, number: u32, body: Bytes) -> Result<(), PostError> {
        let mut state = lock(&self.state);
        if number != state.next {
            return if number < state.next { Ok(()) } else { Err(PostError::Gap) };
        }
        self.bodies.try_send(body).map_err(|error| match error {
            mpsc::error::TrySendError::Full(_) => PostError::Full,
            mpsc::error::TrySendError::Closed(_) => PostError::Ended,
        })?;
        state.next += 1;
        Ok(())
    }
}

/// The posts of one session in order. Dropping them ends the id.
pub struct Posts {
    id: u128,
    bodies: mpsc::Receiver<Bytes>,
    streams: Arc<PostStreams>,
}

impl Posts {
    /// The session's id as it appears in addresses.
    pub fn id(&self) -> String {
        format!("{:032x}", self.id)
    }
}

impl Drop for Posts {
    fn drop(&mut self) {
        lock(&self.streams.0).remove(&self.id);
    }
}

/// Reads the bodies of a session's posts, and ends when the connection of the streamed response does.
pub struct PostReader {
    posts: Posts,
    /// The rest of the newest body.
    body: Bytes,
    connection: FromPeer,
}

impl PostReader {
    pub fn new(posts: Posts, connection: FromPeer) -> PostReader {
        PostReader { posts, body: Bytes::new(), connection }
    }

    /// Resolves when the peer closes the connection. It must send nothing after its request.
    fn poll_end(&mut self, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        let mut memory = [0];
        let mut byte = ReadBuf::new(&mut memory);
        ready!(Pin::new(&mut self.connection).poll_read(context, &mut byte))?;
        Poll::Ready(match byte.filled() {
            [] => Ok(()),
            _ => Err(ErrorKind::InvalidData.into()),
        })
    }
}

impl AsyncRead for PostReader {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        // Posts come first: a client that leaves closes the connection right after its last one.
        while self.body.is_empty() {
            match self.posts.bodies.poll_recv(context) {
                Poll::Ready(Some(body)) => self.body = body,
                _ => return self.poll_end(context),
            }
        }
        let count = self.body.len().min(buffer.remaining());
        buffer.put_slice(&self.body.split_to(count));
        Poll::Ready(Ok(()))
    }
}

/// Ignores poisoning: no operation here panics halfway.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn posts_are_taken_once_and_in_order() {
        let streams = Arc::default();
        let mut posts = PostStreams::open(&streams, 7);
        let queue = streams.find(7).expect("a session");
        assert!(streams.find(8).is_none());
        let body = |fill: u8| Bytes::from(vec![fill; 3]);
        assert_eq!(queue.push(1, body(1)), Err(PostError::Gap));
        assert_eq!(queue.push(0, body(0)), Ok(()));
        assert_eq!(queue.push(0, body(9)), Ok(()), "the answer was lost");
        assert_eq!(queue.push(1, body(1)), Ok(()));
        assert_eq!(queue.push(2, body(2)), Err(PostError::Full));
        assert_eq!(posts.bodies.try_recv(), Ok(body(0)));
        assert_eq!(queue.push(2, body(2)), Ok(()), "there is a place again");
        assert_eq!([1, 2].map(|_| posts.bodies.try_recv()), [Ok(body(1)), Ok(body(2))]);
        assert!(posts.bodies.try_recv().is_err(), "repeated posts are ignored");
        drop(posts);
        assert!(streams.find(7).is_none());
        assert_eq!(queue.push(3, body(3)), Err(PostError::Ended));
    }

    #[test]
    fn a_session_may_send_as_many_posts_as_messages() {
        let streams = Arc::default();
        let _posts = PostStreams::open(&streams, 1);
        let (queue, now) = (streams.find(1).expect("a session"), Instant::now());
        let admitted = (0..1000).filter(|_| queue.admit(now)).count();
        assert_eq!(admitted, MESSAGES_BURST_MAX as usize);
    }

    #[test]
    fn an_id_has_32_digits() {
        let streams = Arc::default();
        assert_eq!(PostStreams::open(&streams, 255).id(), format!("{}ff", "0".repeat(30)));
    }
}
