//! Bodies of requests: bounded in length and time.

use super::response::{Answer, failed};
use crate::state::ServerState;
use http_body_util::{BodyExt, LengthLimitError, Limited};
use hyper::body::{Bytes, Incoming};
use hyper::{Request, StatusCode};
use tokio::time::timeout;

/// Error of [`body`].
#[derive(Debug)]
pub enum ReadError {
    /// It is longer than allowed.
    TooLong,
    /// The connection broke, or the body is no HTTP.
    Broken,
    /// It did not come in time.
    Late,
}

/// Reads a body of at most `bytes_max`.
pub async fn body(
    request: Request<Incoming>,
    bytes_max: usize,
    state: &ServerState,
) -> Result<Bytes, ReadError> {
    let limited = Limited::new(request.into_body(), bytes_max);
    match timeout(state.config.waits.http_body, limited.collect()).await {
        Ok(Ok(body)) => Ok(body.to_bytes()),
        Ok(Err(error)) if error.is::<LengthLimitError>() => Err(ReadError::TooLong),
        Ok(Err(_)) => Err(ReadError::Broken),
        Err(_late) => Err(ReadError::Late),
    }
}

impl ReadError {
    /// The response to it.
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
        }
    }
}
