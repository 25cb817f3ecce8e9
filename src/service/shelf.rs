//! What workers hold at once of the memory: studies that they have read, and what the chunks come to that they compute.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use parking_lot::Mutex;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::room;

/// Room that slots share. Those who want more than a slot's share are counted: together they take no more than all the room, or one is alone. The others are not:
/// there are no more of them than slots, so that they take no more than as much again.
#[derive(Debug)]
pub struct SharedRoom {
    free: Arc<Semaphore>,
    all_bytes: u64,
    share_bytes: u64,
}

impl SharedRoom {
    /// Of so many bytes.
    pub fn new(all_bytes: u64, slots: usize) -> Self {
        let free = Arc::new(Semaphore::new(room::permits(all_bytes) as usize));
        Self { free, all_bytes, share_bytes: all_bytes / slots.max(1) as u64 }
    }

    /// Whether so many bytes are a slot's share at most.
    const fn is_small(&self, bytes: u64) -> bool {
        bytes <= self.share_bytes
    }

    fn permits(&self, bytes: u64) -> u32 {
        if self.is_small(bytes) { 0 } else { room::permits(bytes.min(self.all_bytes)) }
    }

    fn try_take(&self, bytes: u64) -> Option<OwnedSemaphorePermit> {
        Arc::clone(&self.free).try_acquire_many_owned(self.permits(bytes)).ok()
    }

    /// Room for so many bytes, when there is: those who wait have it in turn. None while there is none for who does not wait.
    pub async fn take(&self, bytes: u64, waits: bool) -> Option<OwnedSemaphorePermit> {
        match self.try_take(bytes) {
            // An error says that the semaphore is closed, which it never is.
            None if waits => Arc::clone(&self.free).acquire_many_owned(self.permits(bytes)).await.ok(),
            taken => taken,
        }
    }
}

/// What takes some of the memory for as long as it is held.
pub trait Takes {
    /// About how much.
    fn bytes(&self) -> u64;
}

/// What was read and may be wanted again: the last few, which make room for what is in use. What is no more on it is let go by its last user.
#[derive(Debug)]
pub struct Shelf<K, V> {
    room: SharedRoom,
    most_bytes: u64,
    kept: Mutex<VecDeque<(K, Arc<V>)>>,
    waiting: AtomicUsize,
}

/// One who waits for room: nothing is kept meanwhile.
struct WaitsForRoom<'a>(&'a AtomicUsize);

impl Drop for WaitsForRoom<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::SeqCst);
    }
}

impl<K: PartialEq, V: Takes> Shelf<K, V> {
    /// For what is in use in these slots, within so many bytes; what is kept besides, or because it is small, takes no more than half of that.
    pub fn new(all_bytes: u64, slots: usize) -> Self {
        let (kept, waiting) = Default::default();
        Self { room: SharedRoom::new(all_bytes, slots), most_bytes: all_bytes / 2, kept, waiting }
    }

    /// Whether what takes so many bytes has room whatever else is in use.
    pub const fn is_small(&self, bytes: u64) -> bool {
        self.room.is_small(bytes)
    }

    /// Room for what is to be read, as [`SharedRoom::take`] has it; what nobody uses gives way.
    pub async fn room(&self, bytes: u64, waits: bool) -> Option<OwnedSemaphorePermit> {
        loop {
            let taken = self.room.try_take(bytes);
            if taken.is_some() {
                return taken;
            }
            if self.kept.lock().pop_front().is_none() {
                break;
            }
        }
        if !waits {
            return None;
        }
        self.waiting.fetch_add(1, Ordering::SeqCst);
        let _waits = WaitsForRoom(&self.waiting);
        // What came since: whoever uses it goes on, and the next one waits for its turn as well.
        self.clear();
        self.room.take(bytes, true).await
    }

    /// What was read, where it is still here.
    pub fn get(&self, key: &K) -> Option<Arc<V>> {
        let mut kept = self.kept.lock();
        let place = kept.iter().position(|(other, _)| other == key)?;
        let found = kept.remove(place)?;
        let value = Arc::clone(&found.1);
        kept.push_back(found);
        Some(value)
    }

    /// Keeps what was read, in the place of what was wanted longest ago; not where somebody waits for room.
    pub fn put(&self, key: K, value: &Arc<V>) {
        let mut kept = self.kept.lock();
        if self.waiting.load(Ordering::SeqCst) > 0 {
            return;
        }
        kept.push_back((key, Arc::clone(value)));
        while kept.iter().map(|(_, value)| value.bytes()).sum::<u64>() > self.most_bytes {
            kept.pop_front();
        }
    }

    /// Keeps only what is wanted.
    pub fn retain(&self, is_wanted: impl Fn(&K) -> bool) {
        self.kept.lock().retain(|(key, _)| is_wanted(key));
    }

    /// Keeps nothing.
    pub fn clear(&self) {
        self.kept.lock().clear();
    }
}

#[cfg(test)]
mod tests {
    use std::pin::pin;
    use std::sync::Arc;

    use tokio::sync::OwnedSemaphorePermit;

    use super::{SharedRoom, Shelf, Takes};

    /// Three studies of such chunks ended a worker of 128 MiB that had been told to compute thirty-two at once.
    #[tokio::test]
    async fn chunks_that_come_to_much_are_in_work_beside_others_only_as_far_as_there_is_room() {
        let room = SharedRoom::new(16 << 20, 8);
        let first = room.take(12 << 20, true).await;
        assert!(first.is_some() && room.take(12 << 20, false).await.is_none());
        assert!(room.take(2 << 20, false).await.is_some(), "a slot's share is there whatever others take");
        assert!(room.take(4 << 20, false).await.is_some());
        let mut large = pin!(room.take(1 << 30, true));
        assert!(futures_util::poll!(&mut large).is_pending());
        assert!(room.take(4 << 20, false).await.is_none(), "it would never have its turn");
        drop(first);
        assert!(large.await.is_some(), "alone it has what it needs");
    }

    /// A study that was read.
    #[derive(Debug)]
    struct Read {
        bytes: u64,
        _room: OwnedSemaphorePermit,
    }

    impl Takes for Read {
        fn bytes(&self) -> u64 {
            self.bytes
        }
    }

    async fn read(shelf: &Shelf<u32, Read>, study: u32, bytes: u64) -> Arc<Read> {
        let read = Arc::new(Read { bytes, _room: shelf.room(bytes, true).await.expect("room") });
        shelf.put(study, &read);
        read
    }

    /// All that waited were kept, and thirteen large ones held a worker's memory for ever.
    #[tokio::test]
    async fn of_the_studies_that_wait_the_last_few_are_kept() {
        let shelf = Shelf::new(16 << 20, 8);
        for study in 0..100 {
            read(&shelf, study, 1 << 20).await;
        }
        let kept = || (0..100).filter(|study| shelf.get(study).is_some()).collect::<Vec<_>>();
        assert_eq!(kept(), (92..100).collect::<Vec<_>>());
        assert!(shelf.get(&92).is_some());
        read(&shelf, 100, 1 << 20).await;
        assert!(shelf.get(&92).is_some() && shelf.get(&93).is_none(), "what was wanted last is kept longest");
        shelf.retain(|study| *study == 92);
        assert_eq!(kept(), [92]);
    }

    #[tokio::test]
    async fn a_study_that_is_kept_makes_room_for_one_that_is_used() {
        let shelf = Shelf::new(16 << 20, 8);
        drop(read(&shelf, 1, 8 << 20).await);
        assert!(shelf.get(&1).is_some());
        let all = shelf.room(16 << 20, false).await;
        assert!(all.is_some() && shelf.get(&1).is_none());
    }

    /// Were they kept meanwhile, one study's chunks would follow each other for ever, and another large one had no turn.
    #[tokio::test]
    async fn while_one_waits_for_room_what_is_in_use_is_not_kept_for_the_next() {
        let shelf = Shelf::new(16 << 20, 8);
        let used = read(&shelf, 1, 8 << 20).await;
        let mut next = pin!(shelf.room(12 << 20, true));
        assert!(futures_util::poll!(&mut next).is_pending());
        assert!(shelf.get(&1).is_none());
        shelf.put(1, &used);
        assert!(shelf.get(&1).is_none());
        assert!(shelf.room(8 << 20, false).await.is_none(), "nor is there room for it before the other had its turn");
        drop(used);
        assert!(next.await.is_some());
        read(&shelf, 2, 8 << 20).await;
        assert!(shelf.get(&2).is_some(), "and then there is");
    }
}
