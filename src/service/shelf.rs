//! What workers hold at once of the memory: studies that they have read, and what the chunks come to that they compute.

use std::collections::VecDeque;
use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use parking_lot::Mutex;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::Instant;

use crate::room;

/// So long is what was read handed out for further use though another waits for its room.
const TURN: Duration = Duration::from_secs(10);

/// Between two looks of who waits at what is not used any more.
const LOOK: Duration = Duration::from_millis(100);

/// Room that slots share. Those who want more than a slot's share are counted: together they take no more than all the room, or one is alone. The others are not:
/// of those in use there are no more than slots, so that they take no more than as much again.
#[derive(Debug)]
pub struct SharedRoom {
    free: Arc<Semaphore>,
    /// One waits at most: the other slots have something else to do.
    waits: Semaphore,
    all_bytes: u64,
    share_bytes: u64,
}

impl SharedRoom {
    /// Of so many bytes.
    pub fn new(all_bytes: u64, slots: usize) -> Self {
        let free = Arc::new(Semaphore::new(room::permits(all_bytes) as usize));
        Self { free, waits: Semaphore::new(1), all_bytes, share_bytes: all_bytes / slots.max(1) as u64 }
    }

    const fn is_small(&self, bytes: u64) -> bool {
        bytes <= self.share_bytes
    }

    fn permits(&self, bytes: u64) -> u32 {
        if self.is_small(bytes) { 0 } else { room::permits(bytes.min(self.all_bytes)) }
    }

    fn is_waited_for(&self) -> bool {
        self.waits.available_permits() == 0
    }

    /// Room for so many bytes, where there is.
    fn try_take(&self, bytes: u64) -> Option<OwnedSemaphorePermit> {
        Arc::clone(&self.free).try_acquire_many_owned(self.permits(bytes)).ok()
    }

    /// Room for so many bytes, when there is; none where another waits for some.
    pub async fn take(&self, bytes: u64) -> Option<OwnedSemaphorePermit> {
        let taken = self.try_take(bytes);
        if taken.is_some() {
            return taken;
        }
        let _waits = self.waits.try_acquire().ok()?;
        // An error says that the semaphore is closed, which it never is.
        Arc::clone(&self.free).acquire_many_owned(self.permits(bytes)).await.ok()
    }
}

/// What was read, for all who use it and the last few for who may want them again. What is not used makes room for what is.
#[derive(Debug)]
pub struct Shelf<K, V> {
    room: SharedRoom,
    /// What was wanted last comes last.
    read: Mutex<VecDeque<Read<K, V>>>,
    most_unused_bytes: u64,
}

#[derive(Debug)]
struct Read<K, V> {
    key: K,
    value: Arc<V>,
    bytes: u64,
    since: Instant,
}

impl<K, V> Read<K, V> {
    fn is_used(&self) -> bool {
        Arc::strong_count(&self.value) > 1
    }
}

impl<K: PartialEq, V> Shelf<K, V> {
    /// For what is used in these slots, within so many bytes.
    pub fn new(all_bytes: u64, slots: usize) -> Self {
        Self { room: SharedRoom::new(all_bytes, slots), read: Mutex::default(), most_unused_bytes: all_bytes / 2 }
    }

    /// Room for what is to be read, where there is, also what is not used and gives way.
    pub fn try_room(&self, bytes: u64) -> Option<OwnedSemaphorePermit> {
        loop {
            let taken = self.room.try_take(bytes);
            if taken.is_some() || !self.drop_unused() {
                return taken;
            }
        }
    }

    /// The same, when there is; none where another waits for some.
    pub async fn room(&self, bytes: u64) -> Option<OwnedSemaphorePermit> {
        let taken = self.try_room(bytes);
        if taken.is_some() {
            return taken;
        }
        tokio::select! {
            taken = self.room.take(bytes) => taken,
            never = self.keep_dropping_unused() => match never {},
        }
    }

    /// Of what is counted, all that comes out of use, for as long as this is polled.
    async fn keep_dropping_unused(&self) -> Infallible {
        loop {
            tokio::time::sleep(LOOK).await;
            while self.drop_unused() {}
        }
    }

    /// Drops of what is counted that which was wanted longest ago and is not used; whether there was some.
    fn drop_unused(&self) -> bool {
        let mut read = self.read.lock();
        let place = read.iter().position(|read| !read.is_used() && !self.room.is_small(read.bytes));
        place.and_then(|place| read.remove(place)).is_some()
    }

    /// What was read, where it is still here: not where another waits for its room and its turn is over.
    pub fn get(&self, key: &K) -> Option<Arc<V>> {
        let mut all = self.read.lock();
        let place = all.iter().position(|read| read.key == *key)?;
        let is_counted = !self.room.is_small(all[place].bytes);
        // It stays until it is not used any more: who waits may have enough before, or leave.
        if is_counted && self.room.is_waited_for() && all[place].since.elapsed() > TURN {
            return None;
        }
        let read = all.remove(place)?;
        let value = Arc::clone(&read.value);
        all.push_back(read);
        Some(value)
    }

    /// Keeps what was read, and takes so many bytes, which it has room for.
    pub fn put(&self, key: K, value: &Arc<V>, bytes: u64) {
        let mut all = self.read.lock();
        all.retain(|read| read.key != key);
        all.push_back(Read { key, value: Arc::clone(value), bytes, since: Instant::now() });
        let mut unused_bytes: u64 = all.iter().filter(|read| !read.is_used()).map(|read| read.bytes).sum();
        all.retain(|read| {
            let stays = unused_bytes <= self.most_unused_bytes || read.is_used();
            if !stays {
                unused_bytes -= read.bytes;
            }
            stays
        });
    }

    /// Keeps only what is wanted.
    pub fn retain(&self, is_wanted: impl Fn(&K) -> bool) {
        self.read.lock().retain(|read| is_wanted(&read.key));
    }

    /// Keeps nothing that is not used.
    pub fn clear(&self) {
        self.read.lock().retain(Read::is_used);
    }
}

#[cfg(test)]
mod tests {
    use std::pin::pin;
    use std::sync::Arc;
    use std::time::Duration;

    use tokio::sync::OwnedSemaphorePermit;

    use super::{SharedRoom, Shelf, TURN};

    const MIB: u64 = 1 << 20;

    /// Three studies of such chunks ended a worker of 128 MiB that had been told to compute thirty-two at once.
    #[tokio::test]
    async fn chunks_that_come_to_much_are_in_work_beside_others_only_as_far_as_there_is_room() {
        let room = SharedRoom::new(16 * MIB, 8);
        let first = room.take(12 * MIB).await;
        assert!(first.is_some());
        let mut large = pin!(room.take(1024 * MIB));
        assert!(futures_util::poll!(&mut large).is_pending());
        assert!(room.take(2 * MIB).await.is_some(), "a slot's share is there whatever others take");
        assert!(room.take(4 * MIB).await.is_none(), "the one who waits would never have its turn");
        assert!(room.take(12 * MIB).await.is_none(), "a second one has something else to do than to wait");
        drop(first);
        assert!(large.await.is_some(), "alone it has what it needs");
    }

    type Studies = Shelf<u32, OwnedSemaphorePermit>;

    fn shelf() -> Studies {
        Shelf::new(16 * MIB, 8)
    }

    async fn read(shelf: &Studies, study: u32, bytes: u64) -> Arc<OwnedSemaphorePermit> {
        let read = Arc::new(shelf.room(bytes).await.expect("room"));
        shelf.put(study, &read, bytes);
        read
    }

    /// All that waited were kept, and thirteen large ones held a worker's memory for ever.
    #[tokio::test]
    async fn of_the_studies_that_nobody_uses_the_last_few_are_kept() {
        let shelf = shelf();
        let used = read(&shelf, 1000, MIB).await;
        for study in 0..100 {
            read(&shelf, study, MIB).await;
        }
        let kept = || (0..=1000).filter(|study| shelf.get(study).is_some()).collect::<Vec<_>>();
        let last = (91..100).chain([1000]).collect::<Vec<_>>();
        assert_eq!(kept(), last, "the last one was in use when it was put there");
        assert!(shelf.get(&91).is_some());
        read(&shelf, 100, MIB).await;
        assert!(shelf.get(&91).is_some() && shelf.get(&92).is_none(), "what was wanted last is kept longest");
        shelf.retain(|study| [91, 1000].contains(study));
        assert_eq!(kept(), [91, 1000]);
        shelf.clear();
        assert_eq!(kept(), [1000]);
        drop(used);
    }

    /// One that is larger than what is kept unused was computed in one slot, however many there were.
    #[tokio::test]
    async fn a_study_in_use_is_there_for_all_slots_however_large_it_is() {
        let shelf = shelf();
        let used = read(&shelf, 1, 100 * MIB).await;
        assert!(shelf.get(&1).is_some_and(|shared| Arc::ptr_eq(&shared, &used)));
    }

    #[tokio::test]
    async fn a_study_that_nobody_uses_makes_room_for_one_that_is_but_small_ones_stay() {
        let shelf = shelf();
        drop(read(&shelf, 1, MIB).await);
        drop(read(&shelf, 2, 7 * MIB).await);
        let used = read(&shelf, 3, 8 * MIB).await;
        assert!(shelf.get(&2).is_some(), "both have room");
        assert!(shelf.try_room(10 * MIB).is_none() && shelf.get(&3).is_some(), "one that is used makes none");
        drop(used);
        assert!(shelf.try_room(10 * MIB).is_some() && shelf.get(&3).is_none() && shelf.get(&1).is_some());
    }

    /// Its chunks would follow each other for ever, and another large one had no turn.
    #[tokio::test(start_paused = true)]
    async fn a_study_that_others_wait_for_is_handed_out_for_a_turn_and_no_longer() {
        let shelf = shelf();
        let used = read(&shelf, 1, 8 * MIB).await;
        tokio::time::sleep(2 * TURN).await;
        assert!(shelf.get(&1).is_some(), "nobody waits");
        drop(used);
        let used = read(&shelf, 2, 12 * MIB).await;
        assert!(shelf.get(&1).is_none());
        let mut next = pin!(shelf.room(12 * MIB));
        assert!(futures_util::poll!(&mut next).is_pending());
        tokio::time::sleep(TURN / 2).await;
        assert!(futures_util::poll!(&mut next).is_pending());
        assert!(shelf.get(&2).is_some(), "its turn is not over");
        tokio::time::sleep(TURN).await;
        assert!(futures_util::poll!(&mut next).is_pending());
        assert!(shelf.get(&2).is_none());
        drop(used);
        assert!(next.await.is_some());
    }

    /// It was read a second time beside itself, or not at all, while its chunks went on.
    #[tokio::test(start_paused = true)]
    async fn a_study_whose_turn_is_over_is_handed_out_again_once_nobody_waits_any_more() {
        let shelf = shelf();
        let used = read(&shelf, 1, 12 * MIB).await;
        let mut next = Box::pin(shelf.room(12 * MIB));
        assert!(futures_util::poll!(&mut next).is_pending());
        tokio::time::sleep(2 * TURN).await;
        assert!(shelf.get(&1).is_none());
        drop(next);
        assert!(shelf.get(&1).is_some_and(|shared| Arc::ptr_eq(&shared, &used)));
    }

    #[tokio::test(start_paused = true)]
    async fn a_study_that_is_used_no_more_while_another_waits_makes_room_for_it() {
        let shelf = shelf();
        let used = read(&shelf, 1, 12 * MIB).await;
        let mut next = pin!(shelf.room(12 * MIB));
        assert!(futures_util::poll!(&mut next).is_pending());
        drop(used);
        let waited = tokio::time::timeout(Duration::from_secs(1), next).await;
        assert!(waited.is_ok_and(|room| room.is_some()));
    }
}
