//! A client's connection as the service sees it: whether it takes what it gets, and whether it is still there.

use std::io::{self, IoSlice};
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Weak};
use std::task::{Context, Poll, ready};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::net::{RecvFlags, recv};
use socket2::SockRef;
use tokio::io::{AsyncRead, AsyncWrite, Interest, ReadBuf};
use tokio::net::TcpStream;
use tokio::time::{Instant, Sleep, sleep, timeout};

/// What a client that is written to has to take at least, on the average over its patience: below it, it is taken for one that does not read.
const LEAST_TAKEN_BYTES_PER_S: u64 = 8 << 10;

/// What tells that a client has closed its side. Where the system can tell that by itself, bytes that nobody has read yet, which make a
/// connection readable all the time, are not waited for again and again.
#[cfg(any(target_os = "linux", target_os = "android"))]
const CLOSED: Interest = Interest::PRIORITY;
#[cfg(not(any(target_os = "linux", target_os = "android")))]
const CLOSED: Interest = Interest::READABLE;

/// Pause between two looks, where it cannot; the first one between looks whether both sides are closed; and what a client that has left is given for what is
/// nearly answered.
const LOOK: Duration = Duration::from_millis(10);

/// The longest pause between two looks whether both sides are closed.
const LONGEST_LOOK: Duration = Duration::from_millis(320);

/// Who is closed because nothing happened has so long to close its side.
const SILENCE: Duration = Duration::from_secs(1);

/// Of what a client still sends after the last answer, read at each look: what the system takes of it.
const PASSED_OVER_BYTES: usize = 1 << 16;

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
    /// Whether the last was written just now, or the client has left: nothing that comes is a request any more.
    is_over: AtomicBool,
    /// Whether the client had more to take than some kilobytes when this side was closed.
    is_large: AtomicBool,
}

impl Stream {
    /// The system is to forget what the client has not taken as soon as the connection is closed here: it would keep that for minutes, and nobody would know.
    fn give_up(&self) {
        let _ = SockRef::from(&self.tcp).set_linger(Some(Duration::ZERO));
    }

    /// The same where that is much: some kilobytes the system may keep.
    fn give_up_much(&self) {
        if self.is_large.load(Ordering::Relaxed) {
            self.give_up();
        }
    }

    fn is_given_up(&self) -> bool {
        matches!(SockRef::from(&self.tcp).linger(), Ok(Some(Duration::ZERO)))
    }

    /// Whether the client has more to take than some kilobytes, where nothing more is written.
    fn has_more_to_take(&self) -> bool {
        // The least that there is: beside more than that the system takes nothing.
        let _ = SockRef::from(&self.tcp).set_send_buffer_size(0);
        let at_once = Timespec { tv_sec: 0, tv_nsec: 0 };
        matches!(poll(&mut [PollFd::new(&self.tcp, PollFlags::OUT)], Some(&at_once)), Ok(0))
    }

    /// Whether both sides are closed, and each knows it of the other: the client has all that it was sent.
    fn is_ended(&self) -> bool {
        self.tcp.peer_addr().is_err()
    }
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

    /// Whether the client has said something that nobody has read yet, and that may be a request.
    pub fn has_unread(&self) -> bool {
        let peek = |stream: &Stream| recv(&stream.tcp, &mut [0], RecvFlags::PEEK | RecvFlags::DONTWAIT);
        let stream = self.0.upgrade().filter(|stream| !stream.is_over.load(Ordering::Relaxed));
        matches!(stream.as_deref().map(peek), Some(Ok((1.., _))))
    }

    /// When it is closed from elsewhere the system keeps no more than some kilobytes of what the client has not taken.
    pub fn give_up_much(&self) {
        if let Some(stream) = self.0.upgrade() {
            stream.give_up_much();
        }
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
        OPEN.fetch_add(1, Ordering::Relaxed);
        let stream = Arc::new(Stream { tcp: stream, is_over: AtomicBool::default(), is_large: AtomicBool::default() });
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
            stream.is_over.store(true, Ordering::Relaxed);
        }
    }

    /// Closes this side, waits until the client has all and has closed its own, and passes over what it still sends, for as long as its patience, or for a second
    /// where nothing happened and it has all but some kilobytes. Who had more to take is given up then.
    ///
    /// A client that sends all of a body before it reads gets its answer only so, where that came before the body's end: to close a
    /// connection with unread bytes resets it, and the answer is lost (RFC 9112, section 9.6).
    pub fn closed(&self) -> impl Future<Output = ()> + Send + 'static {
        let (stream, patience) = (Arc::clone(&self.stream), self.patience);
        async move {
            if stream.is_given_up() {
                return;
            }
            let is_large = stream.has_more_to_take();
            stream.is_large.store(is_large, Ordering::Relaxed);
            let is_taking = is_large || stream.is_over.load(Ordering::Relaxed);
            let patience = if is_taking { patience } else { SILENCE };
            let _ = rustix::net::shutdown(&stream.tcp, rustix::net::Shutdown::Write);
            let until = Instant::now() + patience;
            let (mut pause, mut passed_over) = (LOOK, vec![0; PASSED_OVER_BYTES]);
            while !stream.is_ended() {
                if Instant::now() >= until {
                    return stream.give_up_much();
                }
                match stream.tcp.try_read(&mut passed_over) {
                    Ok(0) => sleep(pause).await,
                    // Who sends without end keeps no thread.
                    Ok(_) => {
                        pause = LOOK;
                        sleep(pause).await;
                    }
                    Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                        let _ = timeout(pause, stream.tcp.readable()).await;
                    }
                    Err(_) => return,
                }
                pause = LONGEST_LOOK.min(2 * pause);
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
                        self.stream.give_up();
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

    /// What is done then: see [`Self::closed`].
    fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.stream.is_over.store(true, Ordering::Relaxed);
        Poll::Ready(Ok(()))
    }
}

#[cfg(test)]
mod tests {
    use futures_util::FutureExt as _;
    use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
    use tokio::net::{TcpListener, TcpSocket};

    use super::*;

    /// Sixteen clients that sent without end after a refusal had all others wait for seconds, health too.
    #[tokio::test]
    async fn who_sends_on_after_the_last_answer_keeps_no_thread() -> io::Result<()> {
        let listener = TcpListener::bind("127.0.0.1:0").await?;
        let mut client = TcpStream::connect(listener.local_addr()?).await?;
        let socket = Socket::new(listener.accept().await?.0, Duration::from_secs(30));
        client.write_all(&[0; 2 * PASSED_OVER_BYTES]).await?;
        let seen = socket.seen();
        socket.stream.tcp.readable().await?;
        assert!(socket.closed().now_or_never().is_none() && seen.has_unread(), "all was read at once");
        Ok(())
    }

    /// Who read slowly, or paused, and had asked for nothing more for 30 s lost the end of its answer otherwise.
    #[tokio::test]
    async fn a_client_has_more_to_take_until_it_has_taken_next_to_all() -> io::Result<()> {
        let listener = TcpListener::bind("127.0.0.1:0").await?;
        let client = TcpSocket::new_v4()?;
        client.set_recv_buffer_size(1 << 12)?;
        let mut client = client.connect(listener.local_addr()?).await?;
        let mut socket = Socket::new(listener.accept().await?.0, Duration::from_secs(30));
        assert!(!socket.stream.has_more_to_take(), "nothing was written");
        SockRef::from(&socket.stream.tcp).set_send_buffer_size(1 << 17)?;
        let answer = [1; 1 << 16];
        socket.write_all(&answer).await?;
        assert!(socket.stream.has_more_to_take());
        client.read_exact(&mut [0; 1 << 16]).await?;
        for _ in 0..1_000_000 {
            if !socket.stream.has_more_to_take() {
                return Ok(());
            }
            tokio::task::yield_now().await;
        }
        panic!("it was all taken")
    }
}
