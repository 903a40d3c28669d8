//! A body that is read from a file.

use crate::limits;
use crate::replays::Readable;
use hyper::body::{Body as HttpBody, Bytes, Frame, SizeHint};
use std::io;
use std::pin::Pin;
use std::task::{Context, Poll, ready};
use tokio::fs::File;
use tokio::io::{AsyncRead, ReadBuf};
use tokio::sync::OwnedSemaphorePermit;

/// A file that is read while it is sent, one frame at a time.
pub struct FileBody {
    file: File,
    left: u64,
    chunk: Box<[u8]>,
    _permit: OwnedSemaphorePermit,
}

impl FileBody {
    /// Opens the readable part of a replay.
    pub async fn open(readable: Readable) -> io::Result<FileBody> {
        let mut file = File::open(&readable.path).await?;
        file.set_max_buf_size(limits::HTTP_FRAME_BYTES_MAX);
        let left = file.metadata().await?.len().min(readable.bytes);
        let chunk = vec![0; limits::HTTP_FRAME_BYTES_MAX].into_boxed_slice();
        Ok(FileBody { file, left, chunk, _permit: readable.permit })
    }
}

impl HttpBody for FileBody {
    type Data = Bytes;
    type Error = io::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context,
    ) -> Poll<Option<io::Result<Frame<Bytes>>>> {
        let body = &mut *self;
        if body.left == 0 {
            return Poll::Ready(None);
        }
        let wanted = body.left.min(body.chunk.len() as u64) as usize;
        let mut buffer = ReadBuf::new(&mut body.chunk[..wanted]);
        if let Err(error) = ready!(Pin::new(&mut body.file).poll_read(context, &mut buffer)) {
            return Poll::Ready(Some(Err(error)));
        }
        let bytes = Bytes::copy_from_slice(buffer.filled());
        if bytes.is_empty() {
            return Poll::Ready(Some(Err(io::ErrorKind::UnexpectedEof.into())));
        }
        body.left -= bytes.len() as u64;
        Poll::Ready(Some(Ok(Frame::data(bytes))))
    }

    fn is_end_stream(&self) -> bool {
        self.left == 0
    }

    fn size_hint(&self) -> SizeHint {
        SizeHint::with_exact(self.left)
    }
}
