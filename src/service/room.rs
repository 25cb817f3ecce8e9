//! Room for large answers that nobody has read yet: while they are made, while they wait in a batch, while they are on their way. However
//! many are asked for, and however slowly they are read, they must not fill the memory.

use std::pin::pin;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Weak};
use std::time::Duration;

use bytes::Bytes;
use parking_lot::Mutex;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::{Instant, timeout_at};

use crate::memory::Memory;
use crate::problem::{Problem, ProblemCode};
use crate::queue::Queue;

/// Answers up to here need no room, so that slow readers of large ones stop nobody's ordinary work; the bound on connections bounds
/// them too.
pub const SMALL_BYTES: u64 = 1 << 18;

/// A request waits for room no longer than this: as long as most that take some are computed for.
const PATIENCE: Duration = Duration::from_secs(5);

/// Room for so many bytes.
#[derive(Debug, Clone)]
pub struct Room {
    /// One permit for each KiB.
    free: Arc<Semaphore>,
    /// Of these, the ones that are held for as long as studies are kept: for an answer that is alone all that is left is all the room.
    kept: Arc<AtomicU32>,
    /// Who waits for it, by the permits that they want: so nobody is kept from a little by who wants much, again and again.
    queue: Arc<Queue>,
    max_bytes: u64,
    memory: Memory,
}

/// A part of the room that is held while nobody waits to read it.
#[derive(Debug)]
pub struct Kept(Reserved);

impl Kept {
    /// More, where it is less.
    ///
    /// # Errors
    /// Where there is not so much left.
    pub fn hold_at_least(&mut self, bytes: u64) -> Result<(), NoRoom> {
        let Self(reserved) = self;
        let before = reserved.permits();
        match reserved.hold_permits(reserved.room.permits_to_keep(bytes), bytes) {
            Err(NoRoom::Taken { .. }) if bytes <= SMALL_BYTES => {}
            held => held?,
        }
        reserved.bytes = reserved.bytes.max(bytes);
        reserved.room.kept.fetch_add(reserved.permits() - before, Ordering::Relaxed);
        Ok(())
    }

    /// As much as it was asked to hold.
    pub const fn bytes(&self) -> u64 {
        self.0.bytes
    }

    /// As much of the room as it is.
    pub fn held_bytes(&self) -> u64 {
        self.0.held_bytes()
    }
}

impl Drop for Kept {
    fn drop(&mut self) {
        self.0.room.kept.fetch_sub(self.0.permits(), Ordering::Relaxed);
    }
}

/// A part of the room, for one answer.
#[derive(Debug)]
pub struct Reserved {
    room: Room,
    held: Option<OwnedSemaphorePermit>,
    /// What it was asked for, which may be more than all the room.
    bytes: u64,
}

/// There is not so much left.
#[derive(Debug, Clone, Copy, thiserror::Error)]
pub enum NoRoom {
    /// As far as is counted.
    #[error(
        "{bytes} bytes are wanted: with what others take, answers that nobody has read yet first of all, more than the {max_bytes} of `max_unread_bytes`; try again in a moment"
    )]
    Taken {
        /// Wanted.
        bytes: u64,
        /// By all at once.
        max_bytes: u64,
    },
    /// Whatever is counted.
    #[error(
        "the service's memory is held but for what it needs itself, and what is asked for is large; try again in a moment, or ask for less"
    )]
    Scarce,
}

impl From<NoRoom> for Problem {
    fn from(error: NoRoom) -> Self {
        Self::new(ProblemCode::TooManyUnreadBytes, error.to_string())
    }
}

/// An answer on its way, which gives its room back when the last client has it or has left.
#[derive(Debug)]
struct OnItsWay {
    answer: Bytes,
    _room: Reserved,
}

/// What one of its clients holds.
struct Share(Arc<OnItsWay>);

impl AsRef<[u8]> for Share {
    fn as_ref(&self) -> &[u8] {
        &self.0.answer
    }
}

/// Whether an answer is on its way to somebody already: it is in memory once, and takes room once.
#[derive(Debug, Clone, Default)]
pub struct Sent(Arc<Mutex<Weak<OnItsWay>>>);

impl Room {
    /// Room for at most `max_bytes` at once.
    pub fn new(max_bytes: u64) -> Self {
        let free = Arc::new(Semaphore::new(permits(max_bytes) as usize));
        let (kept, queue, memory) = Default::default();
        Self { free, kept, queue, max_bytes, memory }
    }

    /// The memory that the room is of.
    pub fn memory(&self) -> &Memory {
        &self.memory
    }

    /// The same room for one who holds so many bytes of it already: all of it is what is left.
    pub fn beside(&self, held_bytes: u64) -> Self {
        Self { max_bytes: self.max_bytes.saturating_sub(held_bytes), ..self.clone() }
    }

    /// Bytes that are taken now.
    pub fn taken_bytes(&self) -> u64 {
        let taken = permits(self.max_bytes) as usize - self.free.available_permits();
        (taken as u64 * 1024).min(self.max_bytes)
    }

    /// Whether more than half of it is taken by what is not kept.
    pub fn has_much_unread(&self) -> bool {
        let all = permits(self.max_bytes) as usize;
        let unread = (all - self.free.available_permits()).saturating_sub(self.kept.load(Ordering::Relaxed) as usize);
        unread > all / 2
    }

    /// None yet.
    pub fn nothing(&self) -> Reserved {
        Reserved { room: self.clone(), held: None, bytes: 0 }
    }

    /// Room for an answer that takes so many bytes. One larger than all the room takes all of it; what it takes beyond these is given as far as the
    /// memory really has it.
    ///
    /// # Errors
    /// Where there is not so much left.
    pub fn reserve(&self, bytes: u64) -> Result<Reserved, NoRoom> {
        let mut reserved = Reserved { room: self.clone(), held: None, bytes };
        reserved.hold_permits(self.permits_for(bytes), bytes)?;
        Ok(reserved)
    }

    /// The same, where nobody waits for as little: none where there is not so much left.
    ///
    /// # Errors
    /// Where memory is scarce.
    pub fn reserve_now(&self, bytes: u64) -> Result<Option<Reserved>, NoRoom> {
        let permits = self.permits_for(bytes);
        if permits > 0 && self.queue.goes_before(u64::from(permits)) {
            return Ok(None);
        }
        match self.reserve(bytes) {
            Err(NoRoom::Taken { .. }) => Ok(None),
            reserved => reserved.map(Some),
        }
    }

    /// The same when there is, and nobody waits for less.
    ///
    /// # Errors
    /// Where that takes too long, and where memory is scarce.
    pub async fn reserve_in_time(&self, deadline: Instant, bytes: u64) -> Result<Reserved, NoRoom> {
        if let Some(reserved) = self.reserve_now(bytes)? {
            return Ok(reserved);
        }
        let permits = self.permits_for(bytes);
        let deadline = deadline.min(Instant::now() + PATIENCE);
        let place = self.queue.come(u64::from(permits));
        loop {
            let mut changed = pin!(self.queue.changed());
            changed.as_mut().enable();
            if self.memory.is_scarce() {
                return Err(NoRoom::Scarce);
            }
            if place.is_first() {
                match self.reserve(bytes) {
                    Err(NoRoom::Taken { .. }) => {}
                    reserved => return reserved,
                }
            }
            if timeout_at(deadline, changed).await.is_err() {
                return Err(NoRoom::Taken { bytes, max_bytes: self.max_bytes });
            }
        }
    }

    /// Room for what is kept: so many bytes, though they were all of it. What is small is kept though there is none, but not where memory is scarce: how much
    /// that comes to is bounded by whoever keeps it.
    ///
    /// # Errors
    /// Where there is not so much left.
    pub fn keep(&self, bytes: u64) -> Result<Kept, NoRoom> {
        let mut kept = Kept(self.nothing());
        kept.hold_at_least(bytes)?;
        Ok(kept)
    }

    /// Whether so many bytes could be kept once so many that are held were given back.
    pub fn could_keep(&self, bytes: u64, given_back_bytes: u64) -> bool {
        bytes <= SMALL_BYTES
            || self.free.available_permits() as u64 + given_back_bytes / 1024 >= u64::from(self.permits_to_keep(bytes))
    }

    fn permits_to_keep(&self, bytes: u64) -> u32 {
        permits(bytes.min(self.max_bytes))
    }

    /// An answer that is kept, taking room until it is dropped.
    ///
    /// # Errors
    /// Where there is not so much in time.
    pub async fn take(&self, deadline: Instant, answer: Bytes, sent: &Sent) -> Result<Bytes, NoRoom> {
        let bytes = answer.len() as u64;
        if bytes <= SMALL_BYTES {
            return Ok(answer);
        }
        let is_on_its_way = || sent.0.lock().upgrade().map(|shared| Bytes::from_owner(Share(shared)));
        if let Some(shared) = is_on_its_way() {
            return Ok(shared);
        }
        let reserved = self.reserve_in_time(deadline, bytes).await?;
        // Others may have waited as well.
        Ok(is_on_its_way().unwrap_or_else(|| reserved.send(answer, sent)))
    }

    fn permits_for(&self, bytes: u64) -> u32 {
        let all = permits(self.max_bytes).saturating_sub(self.kept.load(Ordering::Relaxed));
        // One at least: where all is kept none is left for an answer.
        if bytes <= SMALL_BYTES { 0 } else { self.permits_to_keep(bytes).min(all.max(1)) }
    }
}

impl Drop for Reserved {
    fn drop(&mut self) {
        if self.held.take().is_some() {
            self.room.queue.tell();
        }
    }
}

impl Reserved {
    /// As much of the room as it is.
    pub fn held_bytes(&self) -> u64 {
        u64::from(self.permits()) * 1024
    }

    fn permits(&self) -> u32 {
        self.held.as_ref().map_or(0, |held| u32::try_from(held.num_permits()).unwrap_or(u32::MAX))
    }

    /// The memory that it is of; none where it is nothing, as of small answers.
    pub fn memory(&self) -> Option<&Memory> {
        self.held.as_ref().map(|_| self.room.memory())
    }

    /// More, where it is less.
    ///
    /// # Errors
    /// Where there is not so much left.
    pub fn hold_at_least(&mut self, bytes: u64) -> Result<(), NoRoom> {
        let more_bytes = bytes.saturating_sub(self.bytes);
        if more_bytes > 0 && bytes > self.room.max_bytes && !self.room.memory.has(more_bytes) {
            return Err(NoRoom::Scarce);
        }
        self.bytes = self.bytes.max(bytes);
        self.hold_permits(self.room.permits_for(bytes), bytes)
    }

    fn hold_permits(&mut self, wanted: u32, bytes: u64) -> Result<(), NoRoom> {
        let lacking = wanted.saturating_sub(self.permits());
        if lacking == 0 {
            return Ok(());
        }
        if self.room.memory.is_scarce() {
            return Err(NoRoom::Scarce);
        }
        let no_room = |_| NoRoom::Taken { bytes, max_bytes: self.room.max_bytes };
        let more = Arc::clone(&self.room.free).try_acquire_many_owned(lacking).map_err(no_room)?;
        match &mut self.held {
            Some(held) => held.merge(more),
            None => self.held = Some(more),
        }
        Ok(())
    }

    /// Less, where it is more.
    pub fn hold_at_most(&mut self, bytes: u64) {
        let most = self.room.permits_for(bytes);
        self.bytes = self.bytes.min(bytes);
        if let Some(held) = &mut self.held {
            let less = held.num_permits().saturating_sub(most as usize);
            drop(held.split(less));
            if less > 0 {
                self.room.queue.tell();
            }
        }
    }

    /// The finished answer, holding its room until its last client has it.
    pub fn send(mut self, answer: Bytes, sent: &Sent) -> Bytes {
        let bytes = answer.len() as u64;
        if bytes <= SMALL_BYTES {
            return answer;
        }
        self.hold_at_most(bytes);
        let shared = Arc::new(OnItsWay { answer, _room: self });
        *sent.0.lock() = Arc::downgrade(&shared);
        Bytes::from_owner(Share(shared))
    }
}

/// Permits for so many bytes: at least one, so that without any room large answers go one at a time, and no more than a semaphore of
/// any machine can count.
pub fn permits(bytes: u64) -> u32 {
    u32::try_from(bytes.div_ceil(1024)).unwrap_or(u32::MAX).clamp(1, u32::MAX >> 3)
}

#[cfg(test)]
mod tests {
    use std::pin::pin;
    use std::time::Duration;

    use futures_util::poll;
    use tokio::time::Instant;

    use super::{NoRoom, PATIENCE, Room};

    const MIB: u64 = 1 << 20;

    fn later() -> Instant {
        Instant::now() + 10 * PATIENCE
    }

    /// One client who asked for one large answer after the other kept all others from any, and from batches.
    #[tokio::test(start_paused = true)]
    async fn who_wants_a_little_room_comes_before_who_wants_all_of_it_again_and_again() -> Result<(), NoRoom> {
        let room = Room::new(64 * MIB);
        let all = room.reserve_in_time(later(), 64 * MIB).await?;
        let mut again = pin!(room.reserve_in_time(later(), 64 * MIB));
        assert!(poll!(&mut again).is_pending());
        let (mut little, mut more) =
            (pin!(room.reserve_in_time(later(), MIB)), pin!(room.reserve_in_time(later(), 2 * MIB)));
        assert!(poll!(&mut little).is_pending() && poll!(&mut more).is_pending());
        drop(all);
        assert!(room.reserve_now(MIB / 2)?.is_some(), "nobody waits for as little");
        assert!(room.reserve_now(64 * MIB)?.is_none() && room.reserve_now(MIB)?.is_none(), "others came before");
        let (little, more) = (little.await?, more.await?);
        assert!(poll!(&mut again).is_pending());
        drop((little, more));
        drop(again.await?);
        assert_eq!(room.taken_bytes(), 0);
        Ok(())
    }

    #[tokio::test(start_paused = true)]
    async fn nobody_waits_for_room_beyond_the_deadline_nor_for_long_nor_where_memory_is_scarce() -> Result<(), NoRoom> {
        let room = Room::new(64 * MIB);
        let _all = room.reserve(64 * MIB)?;
        for (deadline, waits) in [(later(), PATIENCE), (Instant::now() + PATIENCE + PATIENCE / 2, PATIENCE / 2)] {
            let came = Instant::now();
            assert!(matches!(room.reserve_in_time(deadline, MIB).await, Err(NoRoom::Taken { .. })));
            assert!(came.elapsed() >= waits && came.elapsed() < waits + Duration::from_millis(10));
        }
        room.memory().set_scarce(true);
        let came = Instant::now();
        assert!(matches!(room.reserve_in_time(later(), MIB).await, Err(NoRoom::Scarce)));
        assert_eq!(came.elapsed(), Duration::ZERO);
        assert!(room.reserve_in_time(later(), 1024).await.is_ok(), "what is small takes none");
        Ok(())
    }
}
