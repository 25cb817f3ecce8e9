//! A client's connection as the service sees it: whether it takes what it gets, and whether it is still there.

use std::io::{self, IoSlice};
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Weak};
use std::task::{Context, Poll, ready};
use std::time::Duration;

use rustix::net::{RecvFlags, recv};
use tokio::io::{AsyncRead, AsyncWrite, Interest, ReadBuf};
use tokio::net::TcpStream;
use tokio::time::{Instant, Sleep, sleep, timeout};

/// What a client that is written to has to take at least, on the average over its patience: below it, it is taken for one that does not read.
const LEAST_TAKEN_BYTES_PER_S: u64 = 8 << 10;

/// Of what is handed to the system, so much waits to be sent at most. Left to itself it takes megabytes, and more only when a third of them is
/// gone: a client that takes its answer slowly would for long look like one that takes nothing.
#[cfg(any(target_os = "linux", target_os = "android"))]
const UNSENT_BYTES: u32 = 1 << 18;

/// What tells that a client has closed its side. Where the system can tell that by itself, bytes that nobody has read yet, which make a
/// connection readable all the time, are not waited for again and again.
#[cfg(any(target_os = "linux", target_os = "android"))]
const CLOSED: Interest = Interest::PRIORITY;
#[cfg(not(any(target_os = "linux", target_os = "android")))]
const CLOSED: Interest = Interest::READABLE;

/// Pause between two looks, where it cannot; and what a client that has left is given for what is nearly answered.
const LOOK: Duration = Duration::from_millis(10);

/// After the last answer, who has sent nothing for so long sends nothing more.
const SILENCE: Duration = Duration::from_secs(1);

/// Of what a client still sends after the last answer, read at once.
const PASSED_OVER_BYTES: usize = 1 << 14;

static OPEN: AtomicUsize = AtomicUsize::new(0);
static SENT_BYTES: AtomicU64 = AtomicU64::new(0);

/// Connections that are open now.
pub fn open() -> usize {
    OPEN.load(Ordering::Relaxed)
}

/// Bytes handed to the network since the process began.
pub fn sent_bytes() -> u64 {
    SENT_BYTES.load(Ordering::Relaxed)
}

/// A connection, counted while it is open.
#[derive(Debug)]
struct Stream {
    tcp: TcpStream,
    /// Whether all is written that will be.
    is_shut: AtomicBool,
}

impl Drop for Stream {
    fn drop(&mut self) {
        OPEN.fetch_sub(1, Ordering::Relaxed);
    }
}

/// A connection as it is seen from elsewhere, which does not keep it open.
#[derive(Debug)]
pub struct Seen(Weak<Stream>);

impl Seen {
    /// Whether it is still open here.
    pub fn is_open(&self) -> bool {
        self.0.strong_count() > 0
    }

    /// Whether the client has said something that nobody has read yet.
    pub fn has_unread(&self) -> bool {
        let peek = |stream: Arc<Stream>| recv(&stream.tcp, &mut [0], RecvFlags::PEEK | RecvFlags::DONTWAIT);
        matches!(self.0.upgrade().map(peek), Some(Ok((1.., _))))
    }
}

/// A connection whose client has to take what it is sent.
#[derive(Debug)]
pub struct Socket {
    stream: Arc<Stream>,
    patience: Duration,
    /// Runs while the client has something to take.
    stalled: Option<Pin<Box<Sleep>>>,
    taken_bytes: u64,
}

impl Socket {
    /// Of a client that takes `LEAST_TAKEN_BYTES_PER_S` over each `patience`, or is left.
    pub fn new(stream: TcpStream, patience: Duration) -> Self {
        // Without it small answers could wait for the client's acknowledgement of earlier ones.
        let _ = stream.set_nodelay(true);
        #[cfg(any(target_os = "linux", target_os = "android"))]
        let _ = socket2::SockRef::from(&stream).set_tcp_notsent_lowat(UNSENT_BYTES);
        OPEN.fetch_add(1, Ordering::Relaxed);
        let stream = Arc::new(Stream { tcp: stream, is_shut: AtomicBool::new(false) });
        Self { stream, patience, stalled: None, taken_bytes: 0 }
    }

    /// The connection as others may see it.
    pub fn seen(&self) -> Seen {
        Seen(Arc::downgrade(&self.stream))
    }

    /// Waits until the client has closed its side, or the connection is broken.
    ///
    /// What reads the connection learns of that only when it has read all that came before; while a request is being answered, one byte
    /// of another one hides it. Who has closed its side for writing alone is taken for gone, here as in hyper.
    pub fn left(&self) -> impl Future<Output = ()> + Send + 'static {
        let stream = Arc::clone(&self.stream);
        async move {
            while stream.tcp.ready(CLOSED).await.is_ok_and(|ready| !ready.is_read_closed()) {
                sleep(LOOK).await;
            }
            // What is nearly answered still goes out.
            sleep(LOOK).await;
        }
    }

    /// Waits, where the last answer is written, until the client has closed its side, and passes over what it still sends: at most for its
    /// patience, and while it sends anything.
    ///
    /// A client that sends all of a body before it reads gets its answer only so, where that came before the body's end: to close a
    /// connection with unread bytes resets it, and the answer is lost (RFC 9112, section 9.6).
    pub fn closed(&self) -> impl Future<Output = ()> + Send + 'static {
        let (stream, patience) = (Arc::clone(&self.stream), self.patience);
        async move {
            if !stream.is_shut.load(Ordering::Relaxed) {
                return;
            }
            let until = Instant::now() + patience;
            let mut passed_over = vec![0; PASSED_OVER_BYTES];
            while Instant::now() < until && matches!(timeout(SILENCE, stream.tcp.readable()).await, Ok(Ok(()))) {
                match stream.tcp.try_read(&mut passed_over) {
                    Ok(0) => return,
                    Ok(_) => {}
                    Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                    Err(_) => return,
                }
            }
        }
    }

    /// One try to write, within the client's patience.
    fn poll_paced(
        &mut self,
        context: &mut Context<'_>,
        write: impl Fn(&TcpStream) -> io::Result<usize>,
    ) -> Poll<io::Result<usize>> {
        loop {
            let written = match self.stream.tcp.poll_write_ready(context) {
                Poll::Ready(Ok(())) => write(&self.stream.tcp),
                Poll::Ready(Err(error)) => Err(error),
                Poll::Pending => {
                    let stalled = self.stalled.get_or_insert_with(|| Box::pin(sleep(self.patience)));
                    ready!(stalled.as_mut().poll(context));
                    self.stalled = None;
                    let least_bytes = u128::from(LEAST_TAKEN_BYTES_PER_S) * self.patience.as_millis() / 1000;
                    if u128::from(std::mem::take(&mut self.taken_bytes)) < least_bytes {
                        return Poll::Ready(Err(io::ErrorKind::TimedOut.into()));
                    }
                    continue;
                }
            };
            match written {
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                Ok(bytes) => {
                    self.taken_bytes += bytes as u64;
                    SENT_BYTES.fetch_add(bytes as u64, Ordering::Relaxed);
                    return Poll::Ready(Ok(bytes));
                }
                Err(error) => return Poll::Ready(Err(error)),
            }
        }
    }
}

impl AsyncRead for Socket {
    fn poll_read(self: Pin<&mut Self>, context: &mut Context<'_>, buffer: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        loop {
            ready!(self.stream.tcp.poll_read_ready(context))?;
            match self.stream.tcp.try_read(buffer.initialize_unfilled()) {
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                read => return Poll::Ready(read.map(|bytes| buffer.advance(bytes))),
            }
        }
    }
}

impl AsyncWrite for Socket {
    fn poll_write(self: Pin<&mut Self>, context: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        self.get_mut().poll_paced(context, |stream| stream.try_write(bytes))
    }

    fn poll_write_vectored(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
        parts: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        self.get_mut().poll_paced(context, |stream| stream.try_write_vectored(parts))
    }

    fn is_write_vectored(&self) -> bool {
        true
    }

    /// Asked for when all that there was is written: the client's time begins anew with what comes next.
    fn poll_flush(mut self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.stalled = None;
        self.taken_bytes = 0;
        Poll::Ready(Ok(()))
    }

    fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.stream.is_shut.store(true, Ordering::Relaxed);
        Poll::Ready(Ok(rustix::net::shutdown(&self.stream.tcp, rustix::net::Shutdown::Write)?))
    }
}
