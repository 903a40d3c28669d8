//! Request bodies, with limits on length and time.

use super::response::{Answer, busy, failed};
use crate::host::Phase;
use crate::host::room_handle::Host;
use crate::state::ServerState;
use http_body_util::{BodyExt, LengthLimitError, Limited};
use hyper::body::{Bytes, Incoming};
use hyper::{Request, StatusCode};
use std::net::IpAddr;
use tokio::time::timeout;

/// An error from [`body`].
#[derive(Debug)]
pub enum ReadError {
    /// The body is longer than allowed.
    TooLong,
    /// The connection broke, or the body is not valid HTTP.
    Broken,
    /// The body did not arrive in time.
    Late,
    /// Too many long bodies are being received, either from this network or in total.
    Busy,
    Closing,
}

/// Reads a body of at most `bytes_max` bytes.
pub async fn body(
    request: Request<Incoming>,
    bytes_max: usize,
    host: &Host,
) -> Result<Bytes, ReadError> {
    let limited = Limited::new(request.into_body(), bytes_max);
    let mut phase = host.phase.clone();
    let read = tokio::select! {
        read = timeout(host.waits.http_body, limited.collect()) => read,
        _ = phase.wait_for(|phase| *phase == Phase::Closing) => return Err(ReadError::Closing),
    };
    match read {
        Ok(Ok(body)) => Ok(body.to_bytes()),
        Ok(Err(error)) if error.is::<LengthLimitError>() => Err(ReadError::TooLong),
        Ok(Err(_)) => Err(ReadError::Broken),
        Err(_late) => Err(ReadError::Late),
    }
}

/// Reads a possibly long body from a client at this address. Only a few such bodies may be received at once. A slow one
/// is dropped in favour of one from a network that sends fewer.
pub async fn long_body(
    request: Request<Incoming>,
    bytes_max: usize,
    address: IpAddr,
    state: &ServerState,
) -> Result<Bytes, ReadError> {
    let read = async {
        let permit = state.shares.long_bodies.admit(address)?;
        permit.set_idle(true);
        tokio::select! {
            read = body(request, bytes_max, &state.host) => Some(read),
            () = permit.gives_way() => None,
        }
    };
    read.await.unwrap_or_else(|| {
        state.refused("bodies_busy", address, "a scene or a run");
        Err(ReadError::Busy)
    })
}

impl ReadError {
    /// The response to this error.
    pub fn answer(&self, bytes_max: usize) -> Answer {
        match self {
            ReadError::TooLong => {
                let text = format!("the body is longer than {bytes_max} bytes");
                failed(StatusCode::PAYLOAD_TOO_LARGE, &text)
            }
            ReadError::Broken => failed(StatusCode::BAD_REQUEST, "the body could not be read"),
            ReadError::Late => {
                let text = "the body came too slowly; send it again";
                failed(StatusCode::REQUEST_TIMEOUT, text)
            }
            ReadError::Busy => {
                busy("too much is being sent by your network or in all; try again in some seconds")
            }
            ReadError::Closing => failed(StatusCode::SERVICE_UNAVAILABLE, "the server is closing"),
        }
    }
}
