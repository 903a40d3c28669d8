//! The signals that the process receives. The first termination signal drains the server. A second one ends the process
//! immediately, as does a drain that exceeds its time limit.

use jostle_server::limits::DRAIN_MAX;
use jostle_server::net::tls::Tls;
use std::io;
use std::time::Duration;
use tokio::runtime::Builder;
use tokio::sync::oneshot;
use tokio::time::timeout;
use tracing::warn;

/// Time allowed for the log thread to write the last line.
const LAST_LINE: Duration = Duration::from_millis(50);
/// Exit status of a process that ends before everything has been closed.
const CUT_SHORT: i32 = 1;

/// Resolves at the first signal. It listens as soon as it is called, so that no signal before the first await is lost,
/// and on a separate thread, so that the process ends in time even if the server's threads are blocked.
pub fn stop() -> io::Result<impl Future<Output = ()>> {
    let runtime = Builder::new_current_thread().enable_all().build()?;
    let (stop, stopped) = oneshot::channel();
    let mut signals = {
        let _entered = runtime.enter();
        StopSignals::new()?
    };
    let follow = async move {
        signals.next().await;
        // The receiver is gone if the server has already ended.
        let _ = stop.send(());
        let reason = match timeout(DRAIN_MAX, signals.next()).await {
            Ok(()) => "a second signal",
            Err(_late) => "the drain took too long",
        };
        warn!(reason, "the process ends at once; what was not written is lost");
        std::thread::sleep(LAST_LINE);
        std::process::exit(CUT_SHORT);
    };
    let thread = std::thread::Builder::new().name("signals".to_owned());
    thread.spawn(move || runtime.block_on(follow))?;
    Ok(async {
        let _ = stopped.await;
    })
}

/// The signals that ask the process to end.
#[cfg(unix)]
struct StopSignals {
    terminate: tokio::signal::unix::Signal,
    interrupt: tokio::signal::unix::Signal,
}

#[cfg(unix)]
impl StopSignals {
    fn new() -> io::Result<StopSignals> {
        use tokio::signal::unix::{SignalKind, signal};
        let [terminate, interrupt] = [SignalKind::terminate(), SignalKind::interrupt()].map(signal);
        Ok(StopSignals { terminate: terminate?, interrupt: interrupt? })
    }

    async fn next(&mut self) {
        tokio::select! {
            _ = self.terminate.recv() => {}
            _ = self.interrupt.recv() => {}
        }
    }
}

#[cfg(not(unix))]
struct StopSignals;

#[cfg(not(unix))]
impl StopSignals {
    fn new() -> io::Result<StopSignals> {
        Ok(StopSignals)
    }

    async fn next(&mut self) {
        // Without a handler, this waits forever; the process can still be killed.
        if tokio::signal::ctrl_c().await.is_err() {
            std::future::pending::<()>().await;
        }
    }
}

/// Rereads the certificates on SIGHUP. A server without certificates ignores the signal, so that an operator's reload
/// does no harm; a server that belongs to a terminal ends with it. Must be called inside the runtime.
#[cfg(unix)]
pub fn read_again_on_hangup(tls: Option<Tls>) -> io::Result<()> {
    use std::io::IsTerminal;
    use tokio::signal::unix::{SignalKind, signal};
    if tls.is_none() && io::stdin().is_terminal() {
        return Ok(());
    }
    let mut hangup = signal(SignalKind::hangup())?;
    tokio::spawn(async move {
        while hangup.recv().await.is_some() {
            match &tls {
                Some(tls) => tls.read_again(),
                None => tracing::info!("SIGHUP: there is no certificate to read again"),
            }
        }
    });
    Ok(())
}

#[cfg(not(unix))]
pub fn read_again_on_hangup(_tls: Option<Tls>) -> io::Result<()> {
    Ok(())
}
