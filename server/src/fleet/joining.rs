//! Joins a server to its fleet. It creates the parts that must exist before the rooms do, and the driver that runs
//! alongside the rooms.

use super::handle::Fleet;
use super::settings::FleetSettings;
use crate::host::room_handle::Host;
use crate::host::rooms::Rooms;
use crate::log::StreamEnd;
use std::io;
use std::sync::Arc;
use tokio::task::JoinHandle;

#[cfg(feature = "nats")]
use super::nats::{Driver, Publisher, connect};

/// A server that is about to join its fleet.
pub struct Joining {
    /// The fleet as sessions see it.
    pub fleet: Arc<Fleet>,
    #[cfg(feature = "nats")]
    publisher: Arc<Publisher>,
    #[cfg(feature = "nats")]
    context: async_nats::jetstream::Context,
    #[cfg(feature = "nats")]
    settings: FleetSettings,
}

#[cfg(feature = "nats")]
impl Joining {
    /// Starts connecting, and also returns the end of the rooms' stream. Fails if an address or the credentials cannot
    /// be read.
    pub async fn new(settings: FleetSettings) -> io::Result<(Joining, StreamEnd)> {
        let context = connect(&settings).await?;
        let fleet = Arc::new(Fleet::new(&settings, crate::host::random()));
        let handle = tokio::runtime::Handle::current();
        let publisher = Arc::new(Publisher::new(Arc::clone(&fleet), handle));
        let (policy, closed) = (Arc::clone(publisher.policy()), Arc::clone(&publisher));
        let stream = StreamEnd { policy, close: Box::new(move || closed.close()) };
        Ok((Joining { fleet, publisher, context, settings }, stream))
    }

    /// Starts the driver for these rooms.
    pub fn start(self, rooms: Arc<Rooms>, host: Arc<Host>) -> JoinHandle<()> {
        let Joining { fleet, publisher, context, settings } = self;
        tokio::spawn(Driver::new(settings, fleet, rooms, host, publisher).run(context))
    }
}

#[cfg(not(feature = "nats"))]
impl Joining {
    /// Always fails, because this program was built without the `nats` feature.
    pub async fn new(_: FleetSettings) -> io::Result<(Joining, StreamEnd)> {
        let text = "a fleet needs a program that was built with the feature `nats`";
        Err(io::Error::new(io::ErrorKind::Unsupported, text))
    }

    /// Never called, because this type has no values.
    pub fn start(self, _: Arc<Rooms>, _: Arc<Host>) -> JoinHandle<()> {
        tokio::spawn(async {})
    }
}
