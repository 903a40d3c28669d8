//! Replays over HTTP: the list, the files, and the page that plays one. A name is only looked up in
//! the list of replays, so no path leads out of their directory.

use super::{Answer, Body, failed, json, not_found};
use crate::replays::{Entry, Readable, Refused};
use crate::{App, limits};
use hyper::body::{Body as HttpBody, Bytes, Frame, SizeHint};
use hyper::header::{self, HeaderValue};
use hyper::{Response, StatusCode};
use serde::Serialize;
use std::io;
use std::pin::Pin;
use std::task::{Context, Poll, ready};
use tokio::fs::File;
use tokio::io::{AsyncRead, ReadBuf};
use tokio::sync::OwnedSemaphorePermit;
use tracing::warn;

#[derive(Serialize)]
struct List {
    replays: Vec<Replay>,
    errors: u64,
    dropped: u64,
}

#[derive(Serialize)]
struct Replay {
    name: String,
    scene: String,
    room: String,
    unix_s: u64,
    bytes: u64,
    recording: bool,
}

impl From<Entry> for Replay {
    fn from(entry: Entry) -> Replay {
        let Entry { name, scene, room, unix_s, bytes, recording } = entry;
        Replay { name, scene, room, unix_s, bytes, recording }
    }
}

/// The newest replays; none where nothing is recorded.
pub fn list(app: &App) -> Answer {
    let mut list = List { replays: Vec::new(), errors: 0, dropped: 0 };
    if let Some(shelf) = &app.replays {
        [_, _, list.dropped, list.errors] = shelf.counters().read();
        list.replays = shelf.list().into_iter().map(Replay::from).collect();
    }
    json(StatusCode::OK, &list)
}

/// Status of the page that plays a replay, named with or without `.jostle`. The page itself says when
/// there is none.
pub fn page_status(name: &str, app: &App) -> StatusCode {
    let name = name.strip_suffix(".jostle").unwrap_or(name);
    match app.replays.as_ref().is_some_and(|shelf| shelf.knows(name)) {
        true => StatusCode::OK,
        false => StatusCode::NOT_FOUND,
    }
}

/// A file: all of it, or as much as is written by now.
pub async fn file(file: &str, app: &App) -> Answer {
    let (Some(shelf), Some(name)) = (&app.replays, file.strip_suffix(".jostle")) else {
        return not_found();
    };
    let readable = match shelf.read(name) {
        Ok(readable) => readable,
        Err(Refused::Unknown) => return not_found(),
        Err(Refused::Busy) => {
            let text = "too many replays are being downloaded; try again later";
            return failed(StatusCode::SERVICE_UNAVAILABLE, text);
        }
    };
    match FileBody::open(readable).await {
        Ok(body) => {
            let mut answer = Response::new(Body::Right(body));
            let headers = answer.headers_mut();
            let bytes = HeaderValue::from_static("application/octet-stream");
            headers.insert(header::CONTENT_TYPE, bytes);
            headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
            answer
        }
        Err(error) => {
            warn!(replay = name, %error, "cannot read a replay");
            not_found()
        }
    }
}

/// A file that is read while it is sent, a little at a time.
pub struct FileBody {
    file: File,
    left: u64,
    chunk: Box<[u8]>,
    _permit: OwnedSemaphorePermit,
}

impl FileBody {
    async fn open(readable: Readable) -> io::Result<FileBody> {
        let mut file = File::open(&readable.path).await?;
        file.set_max_buf_size(limits::REPLAY_CHUNK_BYTES);
        let left = file.metadata().await?.len().min(readable.bytes);
        let chunk = vec![0; limits::REPLAY_CHUNK_BYTES].into_boxed_slice();
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
