//! Runs a fleet over NATS. The directory is kept in two key-value buckets, and the records are kept in a stream. No
//! tick waits for any of this.

mod driver;
mod follower;
mod link;
mod publisher;
mod records;
mod room_task;
mod store;

pub use driver::Driver;
pub use publisher::Publisher;
pub use store::Store;

use super::settings::FleetSettings;
use crate::limits;
use async_nats::ConnectOptions;
use async_nats::jetstream::{self, Context};
use async_nats::{Event, ServerAddr};
use std::future::ready;
use std::io;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tracing::{info, warn};

/// Time after which an unchanged NATS error is logged again.
const FLEET_ERROR_AGAIN: Duration = Duration::from_secs(60);

/// Opens a connection that is established in the background, and re-established whenever it is lost. Fails if an
/// address or the credentials cannot be read.
pub async fn connect(settings: &FleetSettings) -> io::Result<Context> {
    let invalid = |error: &dyn std::fmt::Display| {
        io::Error::new(io::ErrorKind::InvalidInput, format!("NATS {}: {error}", settings.nats))
    };
    let servers = settings.nats.split(',').map(|address| address.trim().parse::<ServerAddr>());
    let servers: Vec<_> = servers.collect::<Result<_, _>>().map_err(|error| invalid(&error))?;
    let mut options = ConnectOptions::new()
        .name(format!("jostle {}", settings.node))
        .retry_on_initial_connect()
        .request_timeout(Some(limits::FLEET_ANSWER))
        .ping_interval(Duration::from_secs(2))
        .reconnect_delay_callback(|attempts| {
            Duration::from_millis(50 << attempts.min(4)).min(Duration::from_millis(500))
        })
        .event_callback({
            let log = Arc::new(EventLog { servers: settings.nats.clone(), told: Mutex::default() });
            move |event| {
                log.write(&event);
                ready(())
            }
        });
    if let Some(file) = &settings.credentials {
        options = options.credentials_file(file).await?;
    }
    let client = options.connect(servers).await.map_err(|error| invalid(&error))?;
    let builder = jetstream::ContextBuilder::new();
    Ok(builder.timeout(limits::FLEET_ANSWER).ack_timeout(limits::FLEET_ANSWER).build(client))
}

/// Logs the connection's events.
struct EventLog {
    servers: String,
    /// The last error logged, and the time when it was logged.
    told: Mutex<Option<(String, Instant)>>,
}

impl EventLog {
    fn write(&self, event: &Event) {
        match event {
            Event::Connected => {
                *self.told() = None;
                info!(servers = %self.servers, "connected to NATS");
            }
            Event::Disconnected => {
                warn!("the connection to NATS is lost; rooms play on as long as the lease lasts")
            }
            Event::ServerError(error) => self.error(error.to_string()),
            Event::ClientError(error) => self.error(error.to_string()),
            _ => {}
        }
    }

    /// Every connection attempt fails with the same error, so it is logged again only after a while.
    fn error(&self, error: String) {
        let mut told = self.told();
        let again =
            |(last, at): &(String, Instant)| *last == error && at.elapsed() < FLEET_ERROR_AGAIN;
        if !told.as_ref().is_some_and(again) {
            warn!(servers = %self.servers, %error, "NATS cannot be reached, or refuses something");
            *told = Some((error, Instant::now()));
        }
    }

    /// Ignores poisoning: no operation here panics halfway.
    fn told(&self) -> MutexGuard<'_, Option<(String, Instant)>> {
        self.told.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
