//! Whose turn it is, among those who have more to do than one slice.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::Duration;

use parking_lot::Mutex;
use tokio::sync::oneshot;

/// More of a step is not counted: after one that took an hour nobody is ahead of others, or behind them, for as long.
const LONGEST: Duration = Duration::from_secs(1);

/// Turns, of which so many are taken at once. The next is for whoever has had the least time. Who comes begins with what the others have had, less the longest of
/// their steps: so it waits for one of these, and not for one of each, and has no more than a step in advance, however many come anew (fair queueing by virtual time: A. Demers,
/// S. Keshav and S. Shenker 1989).
#[derive(Debug, Clone)]
pub struct Turns(Arc<Mutex<Queue>>);

#[derive(Debug)]
struct Queue {
    free: usize,
    /// The time that each of those has had who want one turn after the other, about.
    even: Duration,
    /// The longest step of late.
    longest: Duration,
    /// Those who wait for their first turn, in the order in which they came.
    new: VecDeque<oneshot::Sender<Turn>>,
    /// The others, by the time that they have had, and the order in which they came.
    waiting: BTreeMap<(Duration, u64), oneshot::Sender<Turn>>,
    came: u64,
}

/// One that is taken, until it is dropped.
#[derive(Debug)]
pub struct Turn(Option<Turns>);

/// The time that one has had; before its first turn none.
#[derive(Debug, Clone, Copy, Default)]
pub struct Had(Option<Duration>);

impl Turns {
    /// So many at once.
    pub fn new(count: usize) -> Self {
        // It begins late enough for everybody to come before.
        let even = Duration::from_secs(24 * 3600);
        let (longest, new, waiting, came) = Default::default();
        Self(Arc::new(Mutex::new(Queue { free: count, even, longest, new, waiting, came })))
    }

    /// Turns that nobody has.
    pub fn free(&self) -> usize {
        self.0.lock().free
    }

    /// A turn, when it comes, for one who has had so much time.
    pub async fn take(&self, had: &Had) -> Turn {
        let told = {
            let mut queue = self.0.lock();
            if queue.free > 0 {
                queue.free -= 1;
                return Turn(Some(self.clone()));
            }
            let (tell, told) = oneshot::channel();
            if had.0.is_none() {
                queue.new.push_back(tell);
            } else {
                queue.came += 1;
                let place = (queue.had(had), queue.came);
                queue.waiting.insert(place, tell);
            }
            told
        };
        // An error: the queue is gone, which it is not before this.
        told.await.unwrap_or(Turn(None))
    }

    /// Notes what somebody has had of a turn.
    pub fn note(&self, had: &mut Had, took: Duration) {
        /// Of the longest so much is forgotten with each step.
        const FORGOTTEN: u32 = 16;
        let took = took.min(LONGEST);
        let mut queue = self.0.lock();
        had.0 = Some(queue.had(had) + took);
        let wanting = u32::try_from(queue.new.len() + queue.waiting.len() + 1).unwrap_or(u32::MAX);
        queue.even += took / wanting;
        queue.longest = took.max(queue.longest - queue.longest / FORGOTTEN);
    }
}

impl Queue {
    /// What one counts as having had, who may come anew, or come back.
    fn had(&self, had: &Had) -> Duration {
        let least = self.even.saturating_sub(self.longest);
        had.0.map_or(least, |had| had.clamp(least, self.even + self.longest))
    }

    /// Who is the next.
    fn next(&mut self) -> Option<oneshot::Sender<Turn>> {
        let least = self.waiting.first_key_value().map(|(&(had, _), _)| had);
        if least.is_none_or(|least| self.had(&Had(None)) <= least)
            && let Some(next) = self.new.pop_front()
        {
            return Some(next);
        }
        let ((had, _), next) = self.waiting.pop_first()?;
        // Who has had least of those who always want some is behind the others by a step at most.
        self.even = self.even.clamp(had, had + self.longest);
        Some(next)
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        let Some(turns) = self.0.take() else { return };
        let mut turn = Self(Some(turns.clone()));
        loop {
            let mut queue = turns.0.lock();
            let Some(next) = queue.next() else {
                queue.free += 1;
                drop(queue);
                turn.0 = None;
                return;
            };
            drop(queue);
            // Who waits no more has let go of the other end.
            match next.send(turn) {
                Ok(()) => return,
                Err(back) => turn = back,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::time::Duration;

    use futures_util::poll;
    use parking_lot::Mutex;
    use tokio::time::Instant;

    use super::{Had, Turns};

    const LONG: Duration = Duration::from_secs(2);
    const SHORT: Duration = Duration::from_millis(5);

    /// A turn that takes so long.
    async fn step(turns: &Turns, had: &mut Had, took: Duration) {
        let turn = turns.take(had).await;
        tokio::time::sleep(took).await;
        turns.note(had, took);
        drop(turn);
    }

    /// A batch of one line waited 44 s behind fifteen of slow ones.
    #[tokio::test(start_paused = true)]
    async fn who_comes_with_little_to_do_waits_for_a_step_and_not_for_one_of_each() {
        let turns = Turns::new(1);
        let others = (0..15).map(|_| {
            let turns = turns.clone();
            tokio::spawn(async move {
                let mut had = Had::default();
                loop {
                    step(&turns, &mut had, LONG).await;
                }
            })
        });
        let others = others.collect::<Vec<_>>();
        // At first each of them is new.
        tokio::time::sleep(15 * LONG).await;
        for _ in 0..30 {
            tokio::time::sleep(19 * LONG / 2).await;
            let came = Instant::now();
            let mut had = Had::default();
            let turn = turns.take(&had).await;
            assert!(came.elapsed() <= LONG, "{:?}", came.elapsed());
            turns.note(&mut had, SHORT);
            drop(turn);
        }
        others.iter().for_each(|other| other.abort());
    }

    #[tokio::test]
    async fn who_has_much_to_do_has_its_share_however_many_come_anew() {
        let turns = Turns::new(1);
        let (mut long, mut rounds, mut anew) = (Had::default(), 0, 0);
        let mut running = turns.take(&Had::default()).await;
        while rounds < 20 {
            let mut takes = Box::pin(turns.take(&long));
            let is_its_turn = loop {
                assert!(poll!(&mut takes).is_pending());
                // Another that nobody knew waits always, with a long step each.
                let mut new = Had::default();
                let mut comes = Box::pin(turns.take(&new));
                assert!(poll!(&mut comes).is_pending());
                drop(running);
                match poll!(&mut takes) {
                    std::task::Poll::Ready(turn) => break turn,
                    std::task::Poll::Pending => running = comes.await,
                }
                turns.note(&mut new, LONG);
                anew += 1;
                assert!(anew <= 3 * (rounds + 1), "{anew} turns of others beside {rounds}");
            };
            drop(takes);
            turns.note(&mut long, LONG);
            running = is_its_turn;
            rounds += 1;
        }
    }

    /// Where nothing held `even` near those who always want turns, those of short steps had a fifth of the time of others.
    #[tokio::test(start_paused = true)]
    async fn who_has_short_steps_has_as_much_of_the_time_as_who_has_long_ones_though_others_come_and_go() {
        let turns = Turns::new(1);
        let lengths = [500, 500, 500, 5, 5, 5].map(Duration::from_millis);
        let times = lengths.map(|length| {
            let turns = turns.clone();
            let time = Arc::new(Mutex::new(Duration::ZERO));
            let counted = Arc::clone(&time);
            let runs = tokio::spawn(async move {
                let mut had = Had::default();
                loop {
                    step(&turns, &mut had, length).await;
                    *counted.lock() += length;
                }
            });
            (time, runs)
        });
        for _ in 0..200 {
            tokio::time::sleep(LONG).await;
            let turns = turns.clone();
            tokio::spawn(async move { step(&turns, &mut Had::default(), LONG / 2).await });
        }
        let times = times.map(|(time, runs)| {
            runs.abort();
            *time.lock()
        });
        let least = times.iter().min().copied().unwrap_or_default();
        assert!(times.iter().all(|&time| least > time * 9 / 10), "{times:?}");
    }

    #[tokio::test]
    async fn who_waits_no_more_is_passed_over_and_no_turn_is_lost() {
        let turns = Turns::new(1);
        let mut all = [Had::default(); 4];
        let [first, second, third, fourth] = &mut all;
        let turn = turns.take(first).await;
        let (mut leaves, mut stays) = (Box::pin(turns.take(second)), Box::pin(turns.take(third)));
        assert!(poll!(&mut leaves).is_pending() && poll!(&mut stays).is_pending());
        drop(leaves);
        let mut told = Box::pin(turns.take(fourth));
        assert!(poll!(&mut told).is_pending());
        drop(turn);
        drop(stays.await);
        // It was told, and has left before it looked.
        drop(told);
        assert_eq!(turns.free(), 1);
        let mut had = Had::default();
        let turn = turns.take(&had).await;
        turns.note(&mut had, SHORT);
        drop(turn);
        assert_eq!(turns.free(), 1);
    }
}
