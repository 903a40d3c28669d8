//! Signals of the process. The first that asks it to end drains the server, and a second one ends it at once; so does
//! the end of the time that a drain may take.

use jostle_server::limits::DRAIN_MAX;
use jostle_server::net::tls::Tls;
use std::io;
use std::time::Duration;
use tokio::runtime::Builder;
use tokio::sync::oneshot;
use tokio::time::timeout;
use tracing::warn;

/// Time for the log's thread to write the last line.
const LAST_LINE: Duration = Duration::from_millis(50);
/// Exit status of a process that ended before everything was closed.
const CUT_SHORT: i32 = 1;

/// Resolves at the first signal. It listens from the call on, so that none before the first await is lost, and on a
/// thread of its own: the process ends in time whatever the server's threads wait for.
pub fn stop() -> io::Result<impl Future<Output = ()>> {
    let runtime = Builder::new_current_thread().enable_all().build()?;
    let (stop, stopped) = oneshot::channel();
    let mut signals = {
        let _entered = runtime.enter();
        StopSignals::new()?
    };
    let follow = async move {
        signals.next().await;
        // A server that has ended by itself waits for nothing.
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

/// The signals that ask a process to end.
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
        // Without a handler there is nothing to wait for; the process can still be killed.
        if tokio::signal::ctrl_c().await.is_err() {
            std::future::pending::<()>().await;
        }
    }
}

/// Has the certificates read again on SIGHUP. A server without any ignores the signal, so that an operator's reload is
/// no harm; but if it belongs to a terminal, it ends with that. To be called within the runtime.
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
