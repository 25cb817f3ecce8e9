//! Who waits for something of which there is not enough: nothing is held meanwhile, and who wants least comes first.

use std::collections::BTreeSet;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use parking_lot::Mutex;
use tokio::sync::Notify;
use tokio::sync::futures::Notified;

/// Those who wait.
#[derive(Debug, Default)]
pub struct Queue {
    /// By what they want, and the order in which they came.
    waiting: Mutex<BTreeSet<(u64, u64)>>,
    came: AtomicU64,
    /// Told when some is given back, or somebody waits no more.
    changed: Notify,
}

/// A place among them, until it is dropped.
#[derive(Debug)]
pub struct Place<'a> {
    queue: &'a Queue,
    place: (u64, u64),
}

impl Queue {
    /// Whether somebody waits for no more than so much.
    pub fn goes_before(&self, wanted: u64) -> bool {
        self.waiting.lock().first().is_some_and(|&(least, _)| least <= wanted)
    }

    /// Comes to wait for so much.
    pub fn come(&self, wanted: u64) -> Place<'_> {
        let place = (wanted, self.came.fetch_add(1, Ordering::Relaxed));
        self.waiting.lock().insert(place);
        Place { queue: self, place }
    }

    /// When the next is told to look.
    pub fn changed(&self) -> Notified<'_> {
        self.changed.notified()
    }

    /// Tells all who wait to look.
    pub fn tell(&self) {
        self.changed.notify_waiters();
    }
}

impl Place<'_> {
    /// Whether nobody who waits comes before.
    pub fn is_first(&self) -> bool {
        self.queue.waiting.lock().first() == Some(&self.place)
    }
}

impl Drop for Place<'_> {
    fn drop(&mut self) {
        self.queue.waiting.lock().remove(&self.place);
        self.queue.tell();
    }
}

/// A lane for one at a time, the shortest of those who wait first.
#[derive(Debug, Clone, Default)]
pub struct Lane(Arc<OneLane>);

#[derive(Debug, Default)]
struct OneLane {
    is_taken: Mutex<bool>,
    queue: Queue,
}

/// The lane, until it is dropped.
#[derive(Debug)]
pub struct OnLane(Lane);

impl Lane {
    /// The lane when it is free, for one of such a length.
    pub async fn take(&self, length: u64) -> OnLane {
        let Self(lane) = self;
        let place = lane.queue.come(length);
        loop {
            let mut changed = pin!(lane.queue.changed());
            changed.as_mut().enable();
            if place.is_first() && !std::mem::replace(&mut *lane.is_taken.lock(), true) {
                return OnLane(self.clone());
            }
            changed.await;
        }
    }
}

impl Drop for OnLane {
    fn drop(&mut self) {
        let Self(Lane(lane)) = self;
        *lane.is_taken.lock() = false;
        lane.queue.tell();
    }
}

#[cfg(test)]
mod tests {
    use std::pin::pin;

    use futures_util::poll;

    use super::Lane;

    /// Forty-five clients whose studies took half a second each to be read kept a short one waiting until its time was over.
    #[tokio::test]
    async fn the_shortest_goes_first_and_one_at_a_time() {
        let lane = Lane::default();
        let first = lane.take(1000).await;
        let (mut long, mut short) = (pin!(lane.take(1000)), pin!(lane.take(10)));
        let mut gone = Box::pin(lane.take(1));
        assert!(poll!(&mut long).is_pending() && poll!(&mut short).is_pending() && poll!(&mut gone).is_pending());
        drop(gone);
        drop(first);
        assert!(poll!(&mut long).is_pending());
        let on_lane = short.await;
        assert!(poll!(&mut long).is_pending());
        drop(on_lane);
        drop(long.await);
        drop(lane.take(1000).await);
    }
}
