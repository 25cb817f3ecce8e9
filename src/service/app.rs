//! State that all requests share.

use std::io;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use tokio::sync::Semaphore;

use crate::compute::budget::Budget;
use crate::compute::cache::Cache;
use crate::compute::pool::{Deadline, Pool};
use crate::ops::config::{Limits, MAX_CONNECTIONS};
use crate::studies::{Storage, Studies};

/// Shared state of the request handlers.
#[derive(Debug)]
pub struct App {
    /// Limits from the settings and the machine.
    pub limits: Limits,
    /// Threads and permits for computations.
    pub pool: Pool,
    /// Cache of finished answers.
    pub cache: Cache,
    /// Byte budget of the large answers.
    pub budget: Budget,
    /// Studies and their results.
    pub studies: Studies,
    /// One permit for each connection that may be opened.
    pub connection_permits: Arc<Semaphore>,
    /// False while the service stops, for readiness probes.
    pub ready: AtomicBool,
}

impl App {
    /// Starts an idle service with these limits.
    pub fn start(limits: Limits, storage: Option<Storage>) -> io::Result<Arc<Self>> {
        let pool = Pool::start(limits.max_concurrent_solves)?;
        Ok(Arc::new(Self {
            limits,
            studies: Studies::new(pool.clone(), limits, storage),
            pool,
            cache: Cache::new(limits.cache_max_bytes),
            budget: Budget::new(limits.max_unread_bytes),
            connection_permits: Arc::new(Semaphore::new(MAX_CONNECTIONS)),
            ready: AtomicBool::new(true),
        }))
    }

    /// Returns the deadline of a request that arrives now.
    pub fn deadline(&self) -> Deadline {
        Deadline::after(self.deadline_span())
    }

    /// Time limit of a request.
    pub const fn deadline_span(&self) -> Duration {
        Duration::from_millis(self.limits.deadline_ms)
    }
}
