//! The threads that serve connections, one for each processor, up to a limit. A connection stays on its thread for life:
//! what a session touches in each tick stays in one processor's cache, and no other thread is woken to share a
//! moment's work.

use crate::host::wakeups::Wakeups;
use crate::limits::SOCKETS_GATHER;
use std::io;
use std::sync::Arc;
use tokio::runtime::{Builder, Handle};
use tokio::sync::oneshot;

/// The threads that serve a server's connections. They end with it, and with them what they still serve.
pub struct SocketThreads {
    threads: Vec<SocketThread>,
    next: usize,
}

struct SocketThread {
    runtime: Handle,
    wakeups: Arc<Wakeups>,
    /// Dropped, it ends the thread.
    _alive: oneshot::Sender<()>,
}

impl SocketThreads {
    /// Starts a thread for each of these, which it wakes sessions by.
    pub fn start(wakeups: &[Arc<Wakeups>]) -> io::Result<SocketThreads> {
        let threads = wakeups.iter().map(SocketThread::start).collect::<io::Result<_>>()?;
        Ok(SocketThreads { threads, next: 0 })
    }

    /// Serves a connection on the thread whose turn it is.
    pub fn spawn<F>(&mut self, serve: impl FnOnce(Arc<Wakeups>) -> F)
    where
        F: Future<Output = ()> + Send + 'static,
    {
        let thread = &self.threads[self.next];
        self.next = (self.next + 1) % self.threads.len();
        thread.runtime.spawn(serve(Arc::clone(&thread.wakeups)));
    }
}

impl SocketThread {
    fn start(wakeups: &Arc<Wakeups>) -> io::Result<SocketThread> {
        // Inputs come one by one, and are not needed before the next tick: so a thread that has served all that was
        // ready lets some more arrive, instead of sleeping and waking for each.
        let gather = || std::thread::sleep(SOCKETS_GATHER);
        let runtime = Builder::new_current_thread()
            .enable_io()
            .enable_time()
            .on_thread_park(gather)
            .build()?;
        let (alive, ended) = oneshot::channel();
        let handle = runtime.handle().clone();
        let delivered = Arc::clone(wakeups);
        let serve = async move {
            tokio::select! {
                never = delivered.deliver() => match never {},
                _ = ended => {}
            }
        };
        let serve = move || {
            runtime.block_on(serve);
            runtime.shutdown_background();
        };
        std::thread::Builder::new().name("sockets".to_owned()).spawn(serve)?;
        Ok(SocketThread { runtime: handle, wakeups: Arc::clone(wakeups), _alive: alive })
    }
}
