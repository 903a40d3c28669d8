//! A body in memory that every connection shares.

use crate::limits::HTTP_FRAME_BYTES_MAX;
use hyper::body::{Body, Bytes, Frame, SizeHint};
use std::convert::Infallible;
use std::pin::Pin;
use std::task::{Context, Poll};

/// Bytes sent in frames of at most [`HTTP_FRAME_BYTES_MAX`], so that a connection which has to copy
/// them, as TLS does, never copies more than a frame ahead of its peer.
#[derive(Debug, Default)]
pub struct MemoryBody(Bytes);

impl MemoryBody {
    /// A body of these bytes.
    pub fn new(bytes: Bytes) -> MemoryBody {
        MemoryBody(bytes)
    }
}

impl Body for MemoryBody {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        _: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        let length = self.0.len().min(HTTP_FRAME_BYTES_MAX);
        let frame = (length > 0).then(|| Ok(Frame::data(self.0.split_to(length))));
        Poll::Ready(frame)
    }

    fn is_end_stream(&self) -> bool {
        self.0.is_empty()
    }

    fn size_hint(&self) -> SizeHint {
        SizeHint::with_exact(self.0.len() as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use http_body_util::BodyExt;

    #[tokio::test]
    async fn bytes_come_in_short_frames_and_in_order() {
        let bytes: Vec<u8> = (0..3 * HTTP_FRAME_BYTES_MAX + 1).map(|at| (at % 251) as u8).collect();
        let mut body = MemoryBody::new(Bytes::from(bytes.clone()));
        let mut collected = Vec::new();
        while !body.is_end_stream() {
            let left = (bytes.len() - collected.len()) as u64;
            assert_eq!(body.size_hint().exact(), Some(left));
            let frame = body.frame().await.expect("a frame").expect("no error");
            let data = frame.into_data().expect("data");
            assert!((1..=HTTP_FRAME_BYTES_MAX).contains(&data.len()));
            collected.extend_from_slice(&data);
        }
        assert_eq!(collected, bytes);
        assert!(body.frame().await.is_none());
    }
}
