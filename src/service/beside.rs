//! Threads for what may wait for long, apart from those that solves run on.

use std::io;

use tokio::sync::oneshot;

/// Runs a job on a thread of its own, whatever it waits for: nothing else waits with it. Where nobody waits for it any more it goes on.
///
/// # Errors
/// Where no thread can be had, or the job panicked.
pub async fn beside<T: Send + 'static>(job: impl FnOnce() -> T + Send + 'static) -> io::Result<T> {
    let (tell, told) = oneshot::channel();
    let work = move || {
        // Whoever asked may have left.
        let _ = tell.send(job());
    };
    std::thread::Builder::new().name("beside".into()).spawn(work)?;
    told.await.map_err(io::Error::other)
}
