//! Who waits for something of which there is not enough, and a lane for one at a time: nothing is held meanwhile.

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

    /// Whether nobody who waits came before.
    pub fn came_first(&self) -> bool {
        let (_, came) = self.place;
        self.queue.waiting.lock().iter().all(|&(_, other)| came <= other)
    }
}

impl Drop for Place<'_> {
    fn drop(&mut self) {
        self.queue.waiting.lock().remove(&self.place);
        self.queue.tell();
    }
}

/// A lane for one at a time: by turns the shortest of those who wait, and who came first, so that nobody is kept from it by many short ones or by many long ones.
#[derive(Debug, Clone, Default)]
pub struct Lane(Arc<OneLane>);

#[derive(Debug, Default)]
struct OneLane {
    state: Mutex<LaneState>,
    queue: Queue,
}

#[derive(Debug, Default)]
struct LaneState {
    is_taken: bool,
    /// How often it was.
    taken: u64,
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
            {
                let mut state = lane.state.lock();
                let is_next = if state.taken.is_multiple_of(2) { place.is_first() } else { place.came_first() };
                if !state.is_taken && is_next {
                    (state.is_taken, state.taken) = (true, state.taken + 1);
                    return OnLane(self.clone());
                }
            }
            changed.await;
        }
    }
}

impl Drop for OnLane {
    fn drop(&mut self) {
        let Self(Lane(lane)) = self;
        lane.state.lock().is_taken = false;
        lane.queue.tell();
    }
}

#[cfg(test)]
mod tests {
    use std::pin::pin;

    use futures_util::poll;

    use super::Lane;

    /// Forty-five clients whose studies took half a second each to be read kept a short one waiting until its time was over; of six with short ones a longer one.
    #[tokio::test]
    async fn the_shortest_and_who_came_first_have_the_lane_by_turns() {
        let lane = Lane::default();
        let mut on_lane = lane.take(1000).await;
        // Who came first, among ever more of either kind.
        let (mut long, mut short) = (Box::pin(lane.take(1000)), Box::pin(lane.take(10)));
        let mut more = Vec::new();
        assert!(poll!(&mut long).is_pending() && poll!(&mut short).is_pending());
        for length in [1, 2, 3, 1000, 1001, 1002] {
            more.push(Box::pin(lane.take(length)));
            assert!(poll!(more.last_mut().expect("it was pushed")).is_pending());
        }
        drop(on_lane);
        on_lane = long.await;
        assert!(poll!(&mut short).is_pending() && poll!(&mut more[1]).is_pending());
        drop(on_lane);
        // The shortest; and one that waits no more holds up nobody.
        on_lane = more.remove(0).await;
        drop(more.remove(0));
        drop(on_lane);
        on_lane = short.await;
        drop(on_lane);
        drop(more);
        drop(lane.take(5).await);
    }

    #[tokio::test]
    async fn one_has_the_lane_at_a_time() {
        let lane = Lane::default();
        let on_lane = lane.take(1).await;
        let mut next = pin!(lane.take(1));
        assert!(poll!(&mut next).is_pending());
        drop(on_lane);
        let on_lane = next.await;
        assert!(poll!(pin!(lane.take(1))).is_pending());
        drop(on_lane);
    }
}
