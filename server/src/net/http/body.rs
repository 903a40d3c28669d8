//! Response bodies: bytes shared by all connections, and files that are read while being sent.

use crate::files::open_regular;
use crate::limits::connection_limits::Permit;
use crate::log::Readable;
use hyper::body::{Body as HttpBody, Bytes, Frame, SizeHint};
use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use tokio::fs::File;
use tokio::io::{AsyncRead, ReadBuf};
use tokio::task::spawn_blocking;

/// Size of one frame of a body, bytes: the most that a connection holds of a body outside shared memory.
const HTTP_FRAME_BYTES_MAX: usize = 16 << 10;

/// A body of known length, sent in frames of at most [`HTTP_FRAME_BYTES_MAX`]. A connection that has to copy them, as
/// TLS does, is never more than one frame ahead of the peer.
#[derive(Debug)]
pub struct ResponseBody {
    source: BodySource,
    left: u64,
    /// Makes the connection idle once the body has been sent.
    busy: Option<BusyGuard>,
    /// Counts the response until the body has been sent.
    counted: Option<Permit>,
}

/// Makes a connection idle when it is dropped.
#[derive(Debug)]
struct BusyGuard(Arc<Permit>);

impl Drop for BusyGuard {
    fn drop(&mut self) {
        self.0.set_idle(true);
    }
}

#[derive(Debug)]
enum BodySource {
    Memory(Bytes),
    File { file: File, chunk: Box<[u8]>, _permit: Permit },
}

impl ResponseBody {
    /// Creates a body from these bytes.
    pub fn new(bytes: Bytes) -> ResponseBody {
        ResponseBody {
            left: bytes.len() as u64,
            source: BodySource::Memory(bytes),
            busy: None,
            counted: None,
        }
    }

    /// Opens the readable part of a replay.
    pub async fn open(readable: Readable) -> io::Result<ResponseBody> {
        let path = readable.path;
        let opened = spawn_blocking(move || open_regular(&path)).await;
        let mut file = File::from_std(opened.map_err(io::Error::other)??);
        file.set_max_buf_size(HTTP_FRAME_BYTES_MAX);
        let left = file.metadata().await?.len().min(readable.bytes);
        let chunk = vec![0; HTTP_FRAME_BYTES_MAX].into_boxed_slice();
        let source = BodySource::File { file, chunk, _permit: readable.permit };
        Ok(ResponseBody { source, left, busy: None, counted: None })
    }

    /// Counts the response until it has been sent.
    pub fn holds(&mut self, permit: Permit) {
        self.counted = Some(permit);
    }

    /// Makes the connection idle as soon as the body has been sent.
    pub fn frees(&mut self, permit: &Arc<Permit>) {
        self.busy = Some(BusyGuard(Arc::clone(permit)));
    }
}

impl HttpBody for ResponseBody {
    type Data = Bytes;
    type Error = io::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<io::Result<Frame<Bytes>>>> {
        let length = self.left.min(HTTP_FRAME_BYTES_MAX as u64) as usize;
        if length == 0 {
            return Poll::Ready(None);
        }
        let bytes = match &mut self.source {
            BodySource::Memory(bytes) => bytes.split_to(length),
            BodySource::File { file, chunk, .. } => {
                let mut buffer = ReadBuf::new(&mut chunk[..length]);
                ready!(Pin::new(file).poll_read(context, &mut buffer))?;
                Bytes::copy_from_slice(buffer.filled())
            }
        };
        if bytes.is_empty() {
            return Poll::Ready(Some(Err(io::ErrorKind::UnexpectedEof.into())));
        }
        self.left -= bytes.len() as u64;
        Poll::Ready(Some(Ok(Frame::data(bytes))))
    }

    fn is_end_stream(&self) -> bool {
        self.left == 0
    }

    fn size_hint(&self) -> SizeHint {
        SizeHint::with_exact(self.left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use http_body_util::BodyExt;

    #[tokio::test]
    async fn bytes_come_in_short_frames_and_in_order() {
        let bytes: Vec<u8> = (0..3 * HTTP_FRAME_BYTES_MAX + 1).map(|at| (at % 251) as u8).collect();
        let mut body = ResponseBody::new(Bytes::from(bytes.clone()));
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
