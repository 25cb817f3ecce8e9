//! What all requests share.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::cache::Cache;
use crate::compute::Pool;
use crate::config::Limits;
use crate::room::Room;
use crate::studies::{Keeping, Studies};

/// What handlers share.
#[derive(Debug)]
pub struct App {
    /// Limits of the service.
    pub limits: Limits,
    /// Where solves run.
    pub pool: Pool,
    /// Finished answers.
    pub cache: Cache,
    /// For answers on their way to clients.
    pub room: Room,
    /// Studies, with what they have come to.
    pub studies: Studies,
    /// Whether the service wants requests: false while it drains.
    pub ready: AtomicBool,
}

impl App {
    /// An idle service within these limits, which keeps studies in memory.
    pub fn new(limits: Limits) -> Arc<Self> {
        Self::keeping(Pool::new(limits), limits, Keeping::in_memory())
    }

    /// An idle service within these limits, which the pool is within too, with its studies kept somewhere.
    pub fn keeping(pool: Pool, limits: Limits, keeping: Keeping) -> Arc<Self> {
        let room = Room::new(limits.max_unread_bytes);
        let pool = pool.beside(&room);
        Arc::new(Self {
            limits,
            studies: Studies::new(pool.clone(), limits, keeping),
            pool,
            cache: Cache::new(limits.cache_max_bytes),
            room,
            ready: AtomicBool::new(true),
        })
    }
}
