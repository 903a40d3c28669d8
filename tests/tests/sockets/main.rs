//! Tests with a real server on a real port and real clients, most of which misbehave. Each test ends by showing that
//! another player's game continued in the meantime.

mod agones;
mod bad_clients;
mod client;
mod clips;
mod close_codes;
#[cfg(unix)]
mod ending;
mod examples;
mod faults;
#[path = "../fleet/cases.rs"]
mod fleet;
mod guests;
mod helpers;
mod hosts;
mod http;
#[cfg(unix)]
mod log;
mod networks;
mod ops;
mod over_http;
#[path = "../particles/clients.rs"]
mod particles;
mod play;
mod power;
mod process;
mod records;
mod replays;
mod restarts;
mod server;
mod sidecar;
mod slow_reader;
mod soak;
mod spectators;
mod stalled_downloads;
mod still_rooms;
#[cfg(unix)]
mod supervised;
mod tls;
