//! The threads that serve connections, one per processor, up to a limit. A connection stays on its thread for life, so
//! that the data that a session uses in each tick stays in one processor's cache and no other thread has to be woken
//! for a moment's work. For the same reason, a small number of connections is kept on one thread.

use crate::host::outbox::SendQueue;
use std::io;
use std::sync::Arc;
use std::time::Duration;
use tokio::runtime::{Builder, Handle};
use tokio::sync::oneshot;
use tokio::task::unconstrained;

/// Number of connections on one thread before another thread is used. Two threads that each wake for half as many take
/// more processor time, and one thread can send to this many in a millisecond or two.
const SOCKETS_FEW: usize = 256;
/// Time per connection for which an idle socket thread lets inputs accumulate before reading them. This may delay
/// inputs and pongs, but not snapshots.
const SOCKETS_GATHER: Duration = Duration::from_micros(20);
/// Maximum total time; see [`SOCKETS_GATHER`].
const SOCKETS_GATHER_MAX: Duration = Duration::from_millis(2);

/// The threads that serve a server's connections. Dropping this ends the threads and their connections.
pub struct SocketThreads(Vec<SocketThread>);

struct SocketThread {
    runtime: Handle,
    send_queue: Arc<SendQueue>,
    /// Cloned once per connection.
    served: Arc<()>,
    /// Dropping this ends the thread.
    _alive: oneshot::Sender<()>,
}

impl SocketThreads {
    /// Starts a thread for each of these queues.
    pub fn start(queues: &[Arc<SendQueue>]) -> io::Result<SocketThreads> {
        queues.iter().map(SocketThread::start).collect::<io::Result<_>>().map(SocketThreads)
    }

    /// Serves a connection on the first thread that has only a few, or else on the thread that has the fewest.
    pub fn spawn<F>(&self, serve: impl FnOnce(Arc<SendQueue>) -> F)
    where
        F: Future<Output = ()> + Send + 'static,
    {
        let load = |thread: &&SocketThread| thread.connections().max(SOCKETS_FEW - 1);
        let thread = self.0.iter().min_by_key(load).expect("there is at least one");
        let (serving, served) = (serve(Arc::clone(&thread.send_queue)), Arc::clone(&thread.served));
        thread.runtime.spawn(async move {
            serving.await;
            drop(served);
        });
    }
}

impl SocketThread {
    fn start(queue: &Arc<SendQueue>) -> io::Result<SocketThread> {
        // Inputs arrive one by one, and are not needed before the next tick. So a thread that has served everything
        // that is ready lets some more arrive, rather than sleeping and waking for each one. Snapshots do not wait.
        let served = Arc::new(());
        let (gathers, counted) = (Arc::clone(queue), Arc::downgrade(&served));
        let gather = move || gathers.pause(gather_time(counted.strong_count().saturating_sub(1)));
        let runtime = Builder::new_current_thread()
            .enable_io()
            .enable_time()
            .on_thread_park(gather)
            .build()?;
        let (alive, ended) = oneshot::channel();
        let handle = runtime.handle().clone();
        let sends = Arc::clone(queue);
        let serve = async move {
            tokio::select! {
                never = unconstrained(sends.serve()) => match never {},
                _ = ended => {}
            }
        };
        let serve = move || {
            runtime.block_on(serve);
            runtime.shutdown_background();
        };
        std::thread::Builder::new().name("sockets".to_owned()).spawn(serve)?;
        let send_queue = Arc::clone(queue);
        Ok(SocketThread { runtime: handle, send_queue, served, _alive: alive })
    }

    fn connections(&self) -> usize {
        Arc::strong_count(&self.served) - 1
    }
}

/// How long a thread with this many connections lets inputs accumulate.
fn gather_time(connections: usize) -> Duration {
    let connections = u32::try_from(connections).unwrap_or(u32::MAX);
    SOCKETS_GATHER.saturating_mul(connections).min(SOCKETS_GATHER_MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;
    use std::thread::{ThreadId, current};
    use tokio::sync::Semaphore;

    #[test]
    fn inputs_gather_for_longer_where_more_players_send_some() {
        assert_eq!(gather_time(0), Duration::ZERO);
        assert_eq!(gather_time(16), Duration::from_micros(320));
        assert_eq!(gather_time(4096), SOCKETS_GATHER_MAX);
    }

    #[test]
    fn few_connections_share_a_thread_and_many_are_spread() {
        let threads = SocketThreads::start(&[Arc::default(), Arc::default()]).expect("threads");
        let (sender, served) = channel();
        let ends = Arc::new(Semaphore::new(0));
        let serve = || -> ThreadId {
            let (sender, ends) = (sender.clone(), Arc::clone(&ends));
            threads.spawn(|_| async move {
                let _ = sender.send(current().id());
                let _ = ends.acquire().await.map(|permit| permit.forget());
            });
            served.recv().expect("it is served")
        };
        let first = serve();
        assert!((1..SOCKETS_FEW).all(|_| serve() == first));
        let second = serve();
        assert_ne!(second, first);
        assert!((1..SOCKETS_FEW).all(|_| serve() == second));
        let on_first = (0..10).filter(|_| serve() == first).count();
        assert_eq!(on_first, 5, "both have the same number");
    }
}
