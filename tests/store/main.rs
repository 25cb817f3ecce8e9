//! The store of studies: in a file, and on a PostgreSQL server where `TOOTHWAVE_TEST_POSTGRES` names an empty database.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt as _;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::task::Poll;
use std::time::Duration;

use sqlx::{Connection as _, PgConnection, SqliteConnection};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpListener;
use tokio::sync::RwLock;
use tokio::time::Instant;
use toothwave_store::{Address, AddressError, Claim, Gap, Lease, MOST_ATTEMPTS, NewStudy, PATIENCE, Store, StoreError};

const LEASE: Duration = Duration::from_secs(60);
const BUSY: Duration = Duration::from_millis(3);

/// A file of its own, gone with it.
struct File(PathBuf);

impl File {
    fn new() -> Self {
        static FILES: AtomicU64 = AtomicU64::new(0);
        let name = format!("toothwave-store-{}-{}", std::process::id(), FILES.fetch_add(1, Ordering::Relaxed));
        Self(std::env::temp_dir().join(name))
    }

    fn address(&self) -> Address {
        Address::File(self.0.clone())
    }
}

impl Drop for File {
    fn drop(&mut self) {
        for ending in ["", "-wal", "-shm"] {
            let _ = std::fs::remove_file(format!("{}{ending}", self.0.display()));
        }
    }
}

fn server() -> Option<Address> {
    let text = std::env::var("TOOTHWAVE_TEST_POSTGRES").ok()?;
    Some(Address::new(&text, None).unwrap())
}

fn study(id: &str, chunks: u64) -> NewStudy {
    NewStudy {
        id: format!("{id}-{}", std::process::id()),
        kind: "map".into(),
        origin: "this".into(),
        document: "{}".into(),
        max_states: 10,
        max_profile_points: 20,
        variants: 7 * chunks,
        chunk_variants: 7,
        chunks,
        canary_variants: 3,
        canary: "yellow".into(),
        lease: LEASE,
        time: Duration::from_secs(3600),
    }
}

/// The tests share the server: what forgets studies of any name has it to itself.
static SERVER: RwLock<()> = RwLock::const_new(());

/// Does the same with a file and with a server.
async fn with_each_store(job: impl AsyncFn(Store)) {
    with_a_file(&job).await;
    let _others = SERVER.read().await;
    with_the_server(&job).await;
}

/// The same, while no other test uses the server.
async fn alone_with_each_store(job: impl AsyncFn(Store)) {
    with_a_file(&job).await;
    let _nobody = SERVER.write().await;
    with_the_server(&job).await;
}

async fn with_a_file(job: &impl AsyncFn(Store)) {
    let file = File::new();
    job(Store::open(&file.address()).await.unwrap()).await;
}

async fn with_the_server(job: &impl AsyncFn(Store)) {
    if let Some(address) = server() {
        let store = migrated(&address).await;
        job(store).await;
    }
}

async fn claimed(store: &Store, study: &NewStudy) -> Lease {
    match store.claim(&study.cut(), LEASE).await.unwrap() {
        Claim::Chunk(lease) => lease,
        other => panic!("{other:?}"),
    }
}

/// The store at this address, with the schema of this build.
async fn migrated(address: &Address) -> Store {
    let store = Store::open(address).await.unwrap();
    store.migrate().await.unwrap();
    store
}

async fn keep(lease: &mut Lease) {
    let part = lease.chunk().to_le_bytes();
    lease.keep(&part, 7, 1, BUSY).await.unwrap();
}

#[tokio::test]
async fn a_study_is_kept_as_it_was_asked_and_once() {
    with_each_store(async |store| {
        let study = study("kept", 3);
        assert_eq!(store.find(&study.id).await.unwrap(), None);
        assert!(store.create(&study).await.unwrap());
        assert!(!store.create(&NewStudy { document: "another".into(), ..study.clone() }).await.unwrap());
        let standing = store.find(&study.id).await.unwrap().unwrap();
        assert!(standing.study.time <= study.time && standing.study.time > study.time / 2);
        assert_eq!(NewStudy { time: study.time, ..standing.study.clone() }, study);
        assert!(standing.is_running() && !standing.is_done());
        let waiting = store.waiting().await.unwrap();
        let waiting = waiting.iter().find(|waiting| waiting.cut.id == study.id).unwrap();
        assert_eq!((&*waiting.origin, waiting.max_states, waiting.document_bytes), ("this", 10, 2));
        let seen = store.look(&study.id).await.unwrap().unwrap();
        assert_eq!((seen.document_bytes, &*seen.study.document), (2, ""));
        assert_eq!(NewStudy { document: study.document.clone(), ..seen.study }, standing.study);
        gone(&store, &study).await;
        assert_eq!(store.find(&study.id).await.unwrap(), None);
    })
    .await;
}

#[tokio::test]
async fn a_chunk_is_in_one_pair_of_hands_and_its_result_is_kept_once() {
    with_each_store(async |store| {
        let study = study("hands", 3);
        store.create(&study).await.unwrap();
        let mut leases = [claimed(&store, &study).await, claimed(&store, &study).await, claimed(&store, &study).await];
        assert_eq!(leases.each_ref().map(Lease::chunk), [0, 1, 2]);
        assert!(matches!(store.claim(&study.cut(), LEASE).await.unwrap(), Claim::None));
        for lease in &mut leases {
            keep(lease).await;
        }
        // A second time changes nothing.
        leases[0].keep(&[9; 8], 100, 100, BUSY).await.unwrap();
        let standing = store.find(&study.id).await.unwrap().unwrap();
        assert!(standing.is_done() && !standing.is_running());
        assert_eq!((standing.done, standing.looked_at, standing.refused), (3, 21, 3));
        assert_eq!(store.chunks_done(&study.cut()).await.unwrap(), [(0, 8), (1, 8), (2, 8)]);
        for kept in store.parts(&study.cut(), 0, 2).await.unwrap() {
            assert_eq!(kept.part, kept.chunk.to_le_bytes());
        }
        assert_eq!(store.parts(&study.cut(), 1, 1).await.unwrap().len(), 1);
        assert!(matches!(store.claim(&study.cut(), LEASE).await.unwrap(), Claim::None));
        gone(&store, &study).await;
    })
    .await;
}

/// More than are opened at once.
const MANY_CHUNKS: u64 = 260;

#[tokio::test]
async fn of_many_chunks_each_is_claimed_once_in_their_order() {
    with_each_store(async |store| {
        let study = study("many", MANY_CHUNKS);
        store.create(&study).await.unwrap();
        for chunk in 0..MANY_CHUNKS {
            let mut lease = claimed(&store, &study).await;
            assert_eq!(lease.chunk(), chunk);
            keep(&mut lease).await;
        }
        assert!(matches!(store.claim(&study.cut(), LEASE).await.unwrap(), Claim::None));
        let standing = store.find(&study.id).await.unwrap().unwrap();
        assert!(standing.is_done());
        assert_eq!(standing.looked_at, study.variants);
        gone(&store, &study).await;
    })
    .await;
}

#[tokio::test]
async fn all_chunks_of_a_study_wait_though_few_are_open_and_none_of_one_that_is_cancelled_or_late() {
    alone_with_each_store(async |store| {
        let before = store.figures().await.unwrap();
        let study = study("waits", MANY_CHUNKS);
        store.create(&study).await.unwrap();
        let figures = store.figures().await.unwrap();
        assert_eq!((figures.waiting - before.waiting, figures.running - before.running), (MANY_CHUNKS, 1));
        store.cancel(&study.id).await.unwrap();
        assert!(matches!(store.claim(&study.cut(), LEASE).await.unwrap(), Claim::None));
        assert_eq!(store.figures().await.unwrap().waiting, before.waiting);
        store.resume(&study.id, Duration::ZERO).await.unwrap();
        assert_eq!(store.figures().await.unwrap().waiting, before.waiting);
        store.resume(&study.id, LEASE).await.unwrap();
        drop(claimed(&store, &study).await);
        assert_eq!(store.figures().await.unwrap().waiting - before.waiting, MANY_CHUNKS);
        gone(&store, &study).await;
        assert_eq!(store.figures().await.unwrap().waiting, before.waiting);
    })
    .await;
}

#[tokio::test]
async fn two_who_find_no_open_chunk_at_once_open_each_once() {
    with_each_store(async |store| {
        for round in 0..20 {
            let study = study(&format!("both-{round}"), 2);
            store.create(&study).await.unwrap();
            let (one, other) = tokio::join!(claimed(&store, &study), claimed(&store, &study));
            assert_eq!(one.chunk() + other.chunk(), 1);
            for lease in [one, other] {
                lease.give_back().await.unwrap();
            }
            gone(&store, &study).await;
        }
    })
    .await;
}

/// A mistaken path had our tables put beside somebody's.
#[tokio::test]
async fn a_file_of_something_else_is_left_as_it_was() {
    let file = File::new();
    let mut theirs = SqliteConnection::connect(&format!("sqlite://{}?mode=rwc", file.0.display())).await.unwrap();
    sqlx::raw_sql("CREATE TABLE bread (flour)").execute(&mut theirs).await.unwrap();
    theirs.close().await.unwrap();
    let before = std::fs::read(&file.0).unwrap();
    assert!(matches!(Store::open(&file.address()).await, Err(StoreError::Foreign(_))));
    assert_eq!(std::fs::read(&file.0).unwrap(), before);
}

/// Whose chunks were all written when it was first kept.
#[tokio::test]
async fn a_study_of_the_first_schema_goes_on_where_it_was() {
    let file = File::new();
    let study = study("older", 3);
    let store = Store::open(&file.address()).await.unwrap();
    store.create(&study).await.unwrap();
    keep(&mut claimed(&store, &study).await).await;
    store.close().await;
    let mut older = SqliteConnection::connect(&format!("sqlite:{}", file.0.display())).await.unwrap();
    let changes = "DROP INDEX counts_of_results; DROP INDEX studies_that_wait; ALTER TABLE studies DROP COLUMN opened; DELETE FROM schema_versions WHERE version > 1";
    sqlx::raw_sql(changes).execute(&mut older).await.unwrap();
    older.close().await.unwrap();
    let store = Store::open(&file.address()).await.unwrap();
    for chunk in 1..3 {
        let mut lease = claimed(&store, &study).await;
        assert_eq!(lease.chunk(), chunk);
        keep(&mut lease).await;
    }
    assert!(matches!(store.claim(&study.cut(), LEASE).await.unwrap(), Claim::None));
    assert!(store.find(&study.id).await.unwrap().unwrap().is_done());
}

/// Of a study of 118 MB each look once took half a second.
#[tokio::test]
async fn how_a_study_in_a_file_stands_is_told_without_going_through_its_parts() {
    let file = File::new();
    Store::open(&file.address()).await.unwrap().close().await;
    let mut opened = SqliteConnection::connect(&format!("sqlite:{}", file.0.display())).await.unwrap();
    for sums in ["SUM(variants), SUM(refused)", "COUNT(*)"] {
        let plan = format!("EXPLAIN QUERY PLAN SELECT {sums} FROM results WHERE study = 'any'");
        let steps: Vec<(i64, i64, i64, String)> =
            sqlx::query_as(sqlx::AssertSqlSafe(plan)).fetch_all(&mut opened).await.unwrap();
        assert!(steps.iter().all(|(_, _, _, step)| step.contains("COVERING INDEX")), "{sums}: {steps:?}");
    }
}

#[tokio::test]
async fn a_lease_that_is_dropped_sets_its_chunk_free_and_three_of_them_make_it_a_gap() {
    with_each_store(async |store| {
        let study = study("gap", 2);
        store.create(&study).await.unwrap();
        for _ in 0..MOST_ATTEMPTS {
            let lease = free_again(&store, &study, 0).await;
            drop(lease);
        }
        let gap = loop {
            match store.claim(&study.cut(), LEASE).await.unwrap() {
                Claim::Gap(chunk) => break chunk,
                // The server has not seen the end of the session yet.
                Claim::Chunk(lease) if lease.chunk() == 1 => lease.give_back().await.unwrap(),
                other => panic!("{other:?}"),
            }
        };
        assert_eq!(gap, 0);
        // Its neighbour goes on.
        let mut other = free_again(&store, &study, 1).await;
        keep(&mut other).await;
        let standing = store.find(&study.id).await.unwrap().unwrap();
        assert_eq!(standing.gaps, [Gap { chunk: 0, attempts: MOST_ATTEMPTS }]);
        assert!(standing.is_exhausted() && !standing.is_done() && !standing.is_running());
        // Asked for again it is tried again.
        store.resume(&study.id, Duration::from_secs(60)).await.unwrap();
        assert!(store.find(&study.id).await.unwrap().unwrap().is_running());
        let mut again = free_again(&store, &study, 0).await;
        keep(&mut again).await;
        assert!(store.find(&study.id).await.unwrap().unwrap().is_done());
        gone(&store, &study).await;
    })
    .await;
}

/// The chunk, as soon as it is free.
async fn free_again(store: &Store, study: &NewStudy, chunk: u64) -> Lease {
    loop {
        match store.claim(&study.cut(), LEASE).await.unwrap() {
            Claim::Chunk(lease) if lease.chunk() == chunk => return lease,
            Claim::Chunk(lease) => lease.give_back().await.unwrap(),
            other => assert!(matches!(other, Claim::None), "{other:?}"),
        }
    }
}

#[tokio::test]
async fn a_chunk_that_is_given_back_was_never_tried() {
    with_each_store(async |store| {
        let study = study("back", 1);
        store.create(&study).await.unwrap();
        for _ in 0..2 * MOST_ATTEMPTS {
            free_again(&store, &study, 0).await.give_back().await.unwrap();
        }
        keep(&mut free_again(&store, &study, 0).await).await;
        assert!(store.find(&study.id).await.unwrap().unwrap().is_done());
        gone(&store, &study).await;
    })
    .await;
}

#[tokio::test]
async fn a_cancelled_study_waits_for_nobody_until_it_is_asked_for_again() {
    with_each_store(async |store| {
        let study = study("cancelled", 2);
        store.create(&study).await.unwrap();
        keep(&mut claimed(&store, &study).await).await;
        store.cancel(&study.id).await.unwrap();
        let standing = store.find(&study.id).await.unwrap().unwrap();
        assert!(standing.is_cancelled && !standing.is_running() && standing.done == 1);
        assert!(store.waiting().await.unwrap().iter().all(|waiting| waiting.cut.id != study.id));
        store.resume(&study.id, Duration::from_secs(60)).await.unwrap();
        assert!(store.waiting().await.unwrap().iter().any(|waiting| waiting.cut.id == study.id));
        gone(&store, &study).await;
    })
    .await;
}

#[tokio::test]
async fn a_study_whose_time_is_over_does_not_run_and_expires_once_nobody_asks() {
    alone_with_each_store(async |store| {
        let study = NewStudy { time: Duration::ZERO, ..study("late", 2) };
        store.create(&study).await.unwrap();
        let standing = store.find(&study.id).await.unwrap().unwrap();
        assert!(standing.is_late() && !standing.is_running());
        assert_eq!(store.expire(Duration::from_secs(60)).await.unwrap(), 0);
        assert!(store.expire(Duration::ZERO).await.unwrap() >= 1);
        assert_eq!(store.find(&study.id).await.unwrap(), None);
    })
    .await;
}

/// Its build's workers may all be gone, and it has no other end.
#[tokio::test]
async fn a_study_that_nobody_asks_for_and_nobody_computes_expires_though_it_waits_for_workers() {
    alone_with_each_store(async |store| {
        let study = study("alone", 2);
        store.create(&study).await.unwrap();
        let lease = claimed(&store, &study).await;
        assert_eq!(store.expire(Duration::from_secs(60)).await.unwrap(), 0);
        assert!(store.find(&study.id).await.unwrap().is_some());
        lease.give_back().await.unwrap();
        assert!(store.expire(Duration::ZERO).await.unwrap() >= 1);
        assert_eq!(store.find(&study.id).await.unwrap(), None);
    })
    .await;
}

/// One that a worker had in its hands kept all others.
#[tokio::test]
async fn a_study_that_is_in_work_does_not_keep_others_from_expiring() {
    let Some(address) = server() else { return };
    let _nobody = SERVER.write().await;
    let store = migrated(&address).await;
    let (held, left) = (study("held-yet", 1), study("left", 1));
    store.create(&held).await.unwrap();
    store.create(&left).await.unwrap();
    let lease = store.hold(&held.cut(), LEASE).await.unwrap();
    assert!(lease.is_some() && store.expire(Duration::ZERO).await.unwrap() >= 1);
    assert_eq!(store.find(&left.id).await.unwrap(), None);
    assert!(store.find(&held.id).await.unwrap().is_some_and(|standing| standing.is_running()));
    drop(lease);
    gone(&store, &held).await;
}

/// Forgotten, whether it runs or not.
async fn gone(store: &Store, study: &NewStudy) {
    store.cancel(&study.id).await.unwrap();
    store.forget(&study.id).await.unwrap();
}

/// The file's store as it is when so many seconds more have passed since anybody asked.
async fn unasked_for(file: &File, seconds: u64) -> Store {
    let mut later = SqliteConnection::connect(&format!("sqlite:{}", file.0.display())).await.unwrap();
    let text = format!("UPDATE studies SET asked_at_s = asked_at_s - {seconds}");
    sqlx::raw_sql(sqlx::AssertSqlSafe(text)).execute(&mut later).await.unwrap();
    later.close().await.unwrap();
    Store::open(&file.address()).await.unwrap()
}

#[tokio::test]
async fn a_study_that_was_computed_of_late_does_not_expire_however_it_ended() {
    let file = File::new();
    let (done, cancelled) = (study("done", 1), study("stopped", 2));
    let store = Store::open(&file.address()).await.unwrap();
    for study in [&done, &cancelled] {
        store.create(study).await.unwrap();
        keep(&mut claimed(&store, study).await).await;
    }
    store.cancel(&cancelled.id).await.unwrap();
    store.close().await;
    let store = unasked_for(&file, 1000).await;
    assert_eq!(store.expire(Duration::from_secs(500)).await.unwrap(), 0);
    assert!(store.find(&done.id).await.unwrap().unwrap().is_done());
    assert!(store.find(&cancelled.id).await.unwrap().unwrap().is_cancelled);
}

#[tokio::test]
async fn a_study_says_how_long_nobody_has_asked_for_it_and_one_that_is_asked_for_does_not_expire() {
    let file = File::new();
    let (asked, left) = (study("asked", 1), study("left", 1));
    let store = Store::open(&file.address()).await.unwrap();
    store.create(&asked).await.unwrap();
    store.create(&left).await.unwrap();
    store.close().await;
    let store = unasked_for(&file, 1000).await;
    let standing = store.find(&asked.id).await.unwrap().unwrap();
    assert!((1000..1100).contains(&standing.unasked.as_secs()), "{:?}", standing.unasked);
    store.touch(&asked.id).await.unwrap();
    assert!(store.find(&asked.id).await.unwrap().unwrap().unasked < Duration::from_secs(100));
    assert_eq!(store.expire(Duration::from_secs(500)).await.unwrap(), 1);
    assert!(store.find(&asked.id).await.unwrap().is_some());
    assert_eq!(store.find(&left.id).await.unwrap(), None);
}

/// Between a look and what follows from it another may let the study go on: it was forgotten with all that it had come to.
#[tokio::test]
async fn a_study_that_goes_on_is_not_forgotten_by_who_has_seen_it_cancelled() {
    let file = File::new();
    let study = study("on", 2);
    let store = Store::open(&file.address()).await.unwrap();
    store.create(&study).await.unwrap();
    keep(&mut claimed(&store, &study).await).await;
    store.cancel(&study.id).await.unwrap();
    store.resume(&study.id, LEASE).await.unwrap();
    store.forget(&study.id).await.unwrap();
    let standing = store.find(&study.id).await.unwrap().unwrap();
    assert!(standing.is_running() && standing.done == 1);
    gone(&store, &study).await;
    assert_eq!(store.find(&study.id).await.unwrap(), None);
    // Nor does anybody wait for one that is gone.
    store.forget(&study.id).await.unwrap();
}

/// The first that could not be deleted kept all that came after it, for ever.
#[tokio::test]
async fn a_study_that_cannot_be_deleted_does_not_keep_others_from_expiring() {
    let file = File::new();
    let studies = [study("one", 1), study("two", 1), study("three", 1)];
    let store = Store::open(&file.address()).await.unwrap();
    for study in &studies {
        store.create(study).await.unwrap();
    }
    store.close().await;
    let mut other = SqliteConnection::connect(&format!("sqlite:{}", file.0.display())).await.unwrap();
    let stays = "CREATE TRIGGER stays BEFORE DELETE ON studies WHEN old.id LIKE 'one%' BEGIN SELECT RAISE(ABORT, 'it stays'); END";
    sqlx::raw_sql(stays).execute(&mut other).await.unwrap();
    other.close().await.unwrap();
    let store = unasked_for(&file, 1000).await;
    assert!(store.expire(Duration::from_secs(500)).await.unwrap_err().to_string().contains("it stays"));
    let [one, two, three] = studies.each_ref().map(|study| store.find(&study.id));
    assert!(one.await.unwrap().is_some() && two.await.unwrap().is_none() && three.await.unwrap().is_none());
}

#[tokio::test]
async fn what_was_kept_in_a_file_is_there_after_its_process() {
    let file = File::new();
    let study = study("again", 2);
    let store = Store::open(&file.address()).await.unwrap();
    store.create(&study).await.unwrap();
    keep(&mut claimed(&store, &study).await).await;
    let unfinished = claimed(&store, &study).await;
    store.close().await;
    drop(unfinished);
    let store = Store::open(&file.address()).await.unwrap();
    assert_eq!(store.chunks_done(&study.cut()).await.unwrap(), [(0, 8)]);
    assert_eq!(claimed(&store, &study).await.chunk(), 1);
}

/// It holds designs.
#[tokio::test]
async fn a_new_file_is_its_owners_alone_and_one_that_is_there_keeps_its_mode() {
    let mode = |path: &str| std::fs::metadata(path).unwrap().permissions().mode() & 0o777;
    let file = File::new();
    let path = file.0.display().to_string();
    let store = Store::open(&file.address()).await.unwrap();
    store.create(&study("mode", 1)).await.unwrap();
    assert_eq!((mode(&path), mode(&format!("{path}-wal"))), (0o600, 0o600));
    store.close().await;
    std::fs::set_permissions(&path, Permissions::from_mode(0o640)).unwrap();
    let store = Store::open(&file.address()).await.unwrap();
    assert_eq!(mode(&path), 0o640);
    store.close().await;
}

#[tokio::test]
async fn a_file_serves_one_process() {
    let file = File::new();
    let _first = Store::open(&file.address()).await.unwrap();
    let second = Store::open(&file.address()).await;
    assert!(matches!(second, Err(StoreError::InUse(_))), "{second:?}");
}

#[tokio::test]
async fn two_workers_share_a_server_and_a_lost_lease_is_somebody_elses() {
    let Some(address) = server() else { return };
    let _others = SERVER.read().await;
    let (one, other) = (migrated(&address).await, Store::open(&address).await.unwrap());
    let study = study("two", 1);
    one.create(&study).await.unwrap();
    let Claim::Chunk(mut silent) = one.claim(&study.cut(), Duration::from_millis(50)).await.unwrap() else { panic!() };
    // Silent for longer than its session may be.
    let mut lease = free_again(&other, &study, 0).await;
    silent.keep(&[1], 1, 0, BUSY).await.unwrap_err();
    // It is kept all the same, apart from the lease that another worker has now.
    silent.keep(&[1], 1, 0, BUSY).await.unwrap();
    lease.keep(&[1], 1, 0, BUSY).await.unwrap();
    let standing = one.find(&study.id).await.unwrap().unwrap();
    assert!(standing.is_done());
    assert_eq!((standing.done, standing.looked_at), (1, 1));
    gone(&one, &study).await;
}

#[tokio::test]
async fn a_worker_that_lives_keeps_its_chunk_however_long_that_takes() {
    let Some(address) = server() else { return };
    let _others = SERVER.read().await;
    let (worker, other) = (migrated(&address).await, Store::open(&address).await.unwrap());
    let study = study("long", 1);
    worker.create(&study).await.unwrap();
    let silence = Duration::from_millis(1500);
    let Claim::Chunk(mut lease) = worker.claim(&study.cut(), silence).await.unwrap() else { panic!() };
    let computing = async {
        tokio::time::sleep(3 * silence).await;
        assert!(matches!(other.claim(&study.cut(), silence).await.unwrap(), Claim::None));
    };
    tokio::select! {
        () = computing => {}
        _ = lease.renew() => {}
    }
    lease.keep(&[1], 7, 0, BUSY).await.unwrap();
    assert!(worker.find(&study.id).await.unwrap().unwrap().is_done());
    gone(&worker, &study).await;
}

/// A server's store, and a study in it that runs.
async fn stored(address: &Address, name: &str, chunks: u64) -> (Store, NewStudy) {
    let store = migrated(address).await;
    let study = study(name, chunks);
    store.create(&study).await.unwrap();
    (store, study)
}

/// Ends the sessions of all leases that are silent in this moment.
const END_LEASES: &str = "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE state = 'idle in transaction' AND datname = current_database()";

/// A session that is none of the store's.
async fn stranger(address: &Address) -> PgConnection {
    let Address::Server(options) = address else { panic!("{address}") };
    PgConnection::connect_with(options).await.unwrap()
}

/// Begins to note an attempt at the first chunk, or to take one back: others who do wait until that has come to its end.
async fn note_as_the_store_does(session: &mut PgConnection, study: &NewStudy) {
    sqlx::raw_sql("BEGIN").execute(&mut *session).await.unwrap();
    let lock = "SELECT pg_advisory_xact_lock(hashtextextended($1, 0))";
    sqlx::query(lock).bind(&study.id).execute(session).await.unwrap();
}

/// Where the server does not flush for a while what was to be noted stands there, seen by nobody, and three such attempts were a gap.
#[tokio::test]
async fn an_attempt_that_is_still_being_noted_is_taken_back_when_that_has_come_to_its_end() {
    let Some(address) = server() else { return };
    let _others = SERVER.read().await;
    let (store, study) = stored(&address, "noted", 1).await;
    let (mut noting, mut other) = (stranger(&address).await, stranger(&address).await);
    let mut waits = async || {
        let waiting = "SELECT COUNT(*) FROM pg_locks WHERE locktype = 'advisory' AND NOT granted";
        while sqlx::query_scalar::<_, i64>(waiting).fetch_one(&mut other).await.unwrap() == 0 {}
    };
    note_as_the_store_does(&mut noting, &study).await;
    let mut claimed = Box::pin(claimed(&store, &study));
    tokio::select! {
        _ = &mut claimed => panic!("whoever notes an attempt waits for others"),
        () = waits() => {}
    }
    sqlx::raw_sql("COMMIT").execute(&mut noting).await.unwrap();
    let lease = claimed.await;
    note_as_the_store_does(&mut noting, &study).await;
    let noted = "INSERT INTO attempts SELECT study, chunk, worker, began_at_s FROM attempts WHERE study = $1";
    sqlx::query(noted).bind(&study.id).execute(&mut noting).await.unwrap();
    let mut given_back = Box::pin(lease.give_back());
    tokio::select! {
        _ = &mut given_back => panic!("nobody knows what is being noted"),
        () = waits() => {}
    }
    sqlx::raw_sql("COMMIT").execute(&mut noting).await.unwrap();
    given_back.await.unwrap();
    let left = "SELECT COUNT(*) FROM attempts WHERE study = $1";
    assert_eq!(sqlx::query_scalar::<_, i64>(left).bind(&study.id).fetch_one(&mut other).await.unwrap(), 0);
    gone(&store, &study).await;
}

/// Three restarts of a server that flushes slowly made a gap of a chunk that nobody had begun.
#[tokio::test]
async fn an_attempt_of_which_nobody_knows_whether_it_was_noted_is_taken_back() {
    let Some(address) = server() else { return };
    let _nobody = SERVER.write().await;
    let (store, study) = stored(&address, "cut", 1).await;
    drop(claimed(&store, &study).await);
    let lease = loop {
        match store.hold(&study.cut(), LEASE).await.unwrap() {
            Some(lease) => break lease,
            None => tokio::task::yield_now().await,
        }
    };
    let (mut noting, mut other) = (stranger(&address).await, stranger(&address).await);
    note_as_the_store_does(&mut noting, &study).await;
    let mut begun = Box::pin(lease.begin());
    let ended = async {
        let end = "SELECT pg_terminate_backend(pid) FROM pg_locks JOIN pg_database ON database = pg_database.oid
            WHERE datname = current_database() AND locktype = 'advisory' AND NOT granted";
        while sqlx::query(end).fetch_all(&mut other).await.unwrap().is_empty() {}
    };
    tokio::select! {
        _ = &mut begun => panic!("whoever notes an attempt waits for others"),
        () = ended => {}
    }
    // As if it had been committed before the session was ended: its name is the next one.
    let names = "SELECT worker FROM attempts WHERE study = $1";
    let before: String = sqlx::query_scalar(names).bind(&study.id).fetch_one(&mut noting).await.unwrap();
    let (worker, number) = before.split_once('#').unwrap();
    let name = format!("{worker}#{:x}", u64::from_str_radix(number, 16).unwrap() + 1);
    let noted = "INSERT INTO attempts SELECT study, chunk, $2, began_at_s FROM attempts WHERE study = $1";
    sqlx::query(noted).bind(&study.id).bind(name).execute(&mut noting).await.unwrap();
    sqlx::raw_sql("COMMIT").execute(&mut noting).await.unwrap();
    assert!(matches!(begun.await, Err(StoreError::Failed(_))));
    // The one that came to nothing before stays noted.
    let left: Vec<String> = sqlx::query_scalar(names).bind(&study.id).fetch_all(&mut other).await.unwrap();
    assert_eq!(left, [before]);
    gone(&store, &study).await;
}

/// Restarts of a server ended three leases of one long chunk, and it was a gap, though all who had computed it lived; or two of three had died, and one had not.
#[tokio::test]
async fn a_lease_that_was_lost_is_taken_again_and_its_attempt_counts_no_more_where_another_has_the_chunk() {
    let Some(address) = server() else { return };
    let _nobody = SERVER.write().await;
    let (store, study) = stored(&address, "lost", 1).await;
    let (cut, silence) = (study.cut(), Duration::from_secs(3));
    let (mut ending, mut looking, mut noting) =
        (stranger(&address).await, stranger(&address).await, stranger(&address).await);
    let mut end_sessions = async || assert_eq!(sqlx::query(END_LEASES).fetch_all(&mut ending).await.unwrap().len(), 1);
    let mut until = async |text: &'static str, count: i64| {
        while sqlx::query_scalar::<_, i64>(text).bind(&study.id).fetch_one(&mut looking).await.unwrap() != count {
            tokio::task::yield_now().await;
        }
    };
    let held = "SELECT COUNT(*) FROM pg_stat_activity WHERE state = 'idle in transaction' AND datname = current_database() AND $1 <> ''";
    let noted = "SELECT COUNT(*) FROM attempts WHERE study = $1";

    let Claim::Chunk(mut holder) = store.claim(&cut, silence).await.unwrap() else { panic!("nobody has it") };
    end_sessions().await;
    until(held, 0).await;
    // Until it says once more that it is alive.
    let said =
        "SELECT COUNT(*) FROM pg_stat_activity WHERE state = 'idle in transaction' AND query = 'SELECT 1' AND $1 <> ''";
    tokio::select! {
        never = holder.renew() => match never {},
        () = until(said, 1) => {}
    }
    assert!(store.hold(&cut, silence).await.unwrap().is_none() && !store.has_free_chunk(&cut).await.unwrap());
    until(noted, 1).await;

    for _ in 0..MOST_ATTEMPTS {
        end_sessions().await;
        until(held, 0).await;
        assert!(store.has_free_chunk(&cut).await.unwrap());
        let mut next = store.hold(&cut, silence).await.unwrap().expect("it is free");
        // It may be a session of its own that has it.
        holder.say().await;
        until(noted, 1).await;
        tokio::select! {
            never = holder.renew() => match never {},
            never = next.renew() => match never {},
            () = until(noted, 0) => {}
        }
        let Claim::Chunk(next) = next.begin().await.unwrap() else { panic!("a gap, though all live") };
        holder = next;
    }

    for _ in 1..MOST_ATTEMPTS {
        let text = "INSERT INTO attempts VALUES ($1, 0, 'dead', unixepoch())";
        sqlx::query(text).bind(&study.id).execute(&mut noting).await.unwrap();
    }
    end_sessions().await;
    until(held, 0).await;
    let mut next = store.hold(&cut, silence).await.unwrap().expect("it is free");
    tokio::select! {
        never = holder.renew() => match never {},
        attempts = next.attempts_that_count() => assert_eq!(attempts.unwrap(), MOST_ATTEMPTS - 1),
    }
    assert!(matches!(next.begin().await.unwrap(), Claim::Chunk(_)));
    drop(holder);
    gone(&store, &study).await;
}

/// It counted as one that runs until the other worker was through with the chunk, minutes later, and nobody could forget it.
#[tokio::test]
async fn a_study_whose_results_are_all_there_waits_for_nobody_though_a_chunk_is_in_work_once_more() {
    let Some(address) = server() else { return };
    let _nobody = SERVER.write().await;
    let (store, study) = stored(&address, "twice", 1).await;
    let mut first = claimed(&store, &study).await;
    let mut stranger = stranger(&address).await;
    assert_eq!(sqlx::query(END_LEASES).fetch_all(&mut stranger).await.unwrap().len(), 1);
    while !store.has_free_chunk(&study.cut()).await.unwrap() {
        tokio::task::yield_now().await;
    }
    let second = claimed(&store, &study).await;
    first.say().await;
    let attempts = "SELECT COUNT(*) FROM attempts WHERE study = $1";
    let attempts = sqlx::query_scalar::<_, i64>(attempts).bind(&study.id).fetch_one(&mut stranger).await.unwrap();
    assert_eq!(attempts, 1, "the second has begun it");
    let is_waiting = async || store.waiting().await.unwrap().iter().any(|waiting| waiting.cut == study.cut());
    let before = store.figures().await.unwrap();
    assert!(is_waiting().await && (before.running, before.waiting) == (1, 1));
    keep(&mut first).await;
    assert!(store.find(&study.id).await.unwrap().unwrap().is_done());
    let after = store.figures().await.unwrap();
    assert!(!is_waiting().await && (after.running, after.waiting, after.in_work) == (0, 0, 1), "{after:?}");
    // Who is told that it waits no more lets go of it.
    second.give_back().await.unwrap();
    gone(&store, &study).await;
}

#[tokio::test]
async fn a_chunk_tells_how_often_it_was_begun_before() {
    with_each_store(async |store| {
        let study = study("begun", 1);
        store.create(&study).await.unwrap();
        for before in 0..2 {
            let mut lease = store.hold(&study.cut(), LEASE).await.unwrap().unwrap();
            assert_eq!(lease.attempts_that_count().await.unwrap(), before);
            assert!(matches!(lease.begin().await.unwrap(), Claim::Chunk(_)));
        }
        gone(&store, &study).await;
    })
    .await;
}

/// As by a worker that was cut off while it opened chunks.
#[tokio::test]
async fn who_wants_a_study_that_another_session_holds_is_told_so_in_time_and_the_server_does_nothing_of_it_later() {
    let Some(address) = server() else { return };
    let _others = SERVER.read().await;
    let (store, study) = stored(&address, "held", 2).await;
    let mut holder = stranger(&address).await;
    sqlx::query("BEGIN").execute(&mut holder).await.unwrap();
    let lock = "SELECT 1 FROM studies WHERE id = $1 FOR NO KEY UPDATE";
    sqlx::query(lock).bind(&study.id).execute(&mut holder).await.unwrap();
    let began = Instant::now();
    let cut = study.cut();
    let (claimed_meanwhile, cancelled, resumed) =
        tokio::join!(store.claim(&cut, LEASE), store.cancel(&study.id), store.resume(&study.id, LEASE));
    assert!(began.elapsed() < PATIENCE, "{:?}", began.elapsed());
    let waiting = "SELECT COUNT(*) FROM pg_stat_activity WHERE pg_backend_pid() = ANY (pg_blocking_pids(pid))";
    assert_eq!(sqlx::query_scalar::<_, i64>(waiting).fetch_one(&mut holder).await.unwrap(), 0);
    for answer in [claimed_meanwhile.map(drop), cancelled, resumed] {
        assert!(matches!(answer, Err(StoreError::Locked)), "{answer:?}");
    }
    // Nobody else's business meanwhile, nor afterwards.
    assert!(store.find(&study.id).await.unwrap().unwrap().is_running());
    sqlx::query("ROLLBACK").execute(&mut holder).await.unwrap();
    keep(&mut claimed(&store, &study).await).await;
    assert!(store.find(&study.id).await.unwrap().unwrap().is_running());
    gone(&store, &study).await;
}

/// The chunk of a gap that was noted in this moment was in nobody's hands for ever, and the study ran.
#[tokio::test]
async fn a_gap_that_is_noted_while_a_study_is_let_go_on_stays_one() {
    let Some(address) = server() else { return };
    let _others = SERVER.read().await;
    let (store, study) = stored(&address, "noted", 2).await;
    // Both are open.
    drop((claimed(&store, &study).await, claimed(&store, &study).await));
    let mut worker = stranger(&address).await;
    let gap = async |worker: &mut PgConnection, chunk: i64| {
        for text in ["INSERT INTO gaps VALUES ($1, $2, 3)", "DELETE FROM chunks WHERE study = $1 AND chunk = $2"] {
            sqlx::query(text).bind(&study.id).bind(chunk).execute(&mut *worker).await.unwrap();
        }
    };
    gap(&mut worker, 0).await;
    // Whoever lets it go on waits for who opens its chunk as well, and then sees the other gap.
    let mut opener = stranger(&address).await;
    sqlx::query("BEGIN").execute(&mut opener).await.unwrap();
    let opens: i32 = sqlx::query_scalar("SELECT pg_backend_pid()").fetch_one(&mut opener).await.unwrap();
    let open = "INSERT INTO chunks VALUES ($1, 0)";
    sqlx::query(open).bind(&study.id).execute(&mut opener).await.unwrap();
    let (resumed, ()) = tokio::join!(store.resume(&study.id, LEASE), async {
        let waits = "SELECT EXISTS (SELECT 1 FROM pg_stat_activity WHERE $1 = ANY (pg_blocking_pids(pid)))";
        while !sqlx::query_scalar::<_, bool>(waits).bind(opens).fetch_one(&mut worker).await.unwrap() {}
        gap(&mut worker, 1).await;
        sqlx::query("COMMIT").execute(&mut opener).await.unwrap();
    });
    resumed.unwrap();
    let standing = store.find(&study.id).await.unwrap().unwrap();
    assert_eq!(standing.gaps, [Gap { chunk: 1, attempts: 3 }]);
    keep(&mut free_again(&store, &study, 0).await).await;
    assert!(store.find(&study.id).await.unwrap().unwrap().is_exhausted());
    store.resume(&study.id, LEASE).await.unwrap();
    keep(&mut free_again(&store, &study, 1).await).await;
    assert!(store.find(&study.id).await.unwrap().unwrap().is_done());
    gone(&store, &study).await;
}

/// As while the server builds an index. The chunk was free then, and after three times given up, though it was computed.
#[tokio::test]
async fn who_has_computed_a_chunk_waits_for_a_lock_and_keeps_its_lease_meanwhile() {
    let Some(address) = server() else { return };
    let _alone = SERVER.write().await;
    let (store, study) = stored(&address, "waiting", 1).await;
    let mut lease = claimed(&store, &study).await;
    let mut another = stranger(&address).await;
    sqlx::raw_sql("BEGIN; LOCK TABLE results IN SHARE MODE").execute(&mut another).await.unwrap();
    let ((), claimed_meanwhile) = tokio::join!(keep(&mut lease), async {
        tokio::time::sleep(PATIENCE * 6 / 10).await;
        let claimed = store.claim(&study.cut(), LEASE).await.unwrap();
        sqlx::query("ROLLBACK").execute(&mut another).await.unwrap();
        claimed
    });
    assert!(matches!(claimed_meanwhile, Claim::None), "{claimed_meanwhile:?}");
    assert!(store.find(&study.id).await.unwrap().unwrap().is_done());
    gone(&store, &study).await;
}

#[tokio::test]
async fn who_migrates_waits_for_others_who_do_for_longer_than_a_single_operation_may_take() {
    let Some(address) = server() else { return };
    let _others = SERVER.read().await;
    let store = Store::open(&address).await.unwrap();
    let mut another = stranger(&address).await;
    sqlx::query("SELECT pg_advisory_lock(7355608)").execute(&mut another).await.unwrap();
    let (migrated, ()) = tokio::join!(store.migrate(), async {
        tokio::time::sleep(PATIENCE).await;
        sqlx::query("SELECT pg_advisory_unlock(7355608)").execute(&mut another).await.unwrap();
    });
    migrated.unwrap();
}

/// A server that lets everybody in and says nothing more.
async fn mute() -> Address {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    tokio::spawn(async move {
        while let Ok((mut client, _)) = listener.accept().await {
            tokio::spawn(async move {
                let mut asked = [0; 1024];
                assert!(client.read(&mut asked).await.unwrap() > 0);
                // AuthenticationOk and ReadyForQuery (PostgreSQL, frontend/backend protocol).
                client.write_all(b"R\0\0\0\x08\0\0\0\0Z\0\0\0\x05I").await.unwrap();
                while client.read(&mut asked).await.is_ok_and(|bytes| bytes > 0) {}
            });
        }
    });
    Address::new(&format!("postgres://nobody@{address}/studies?sslmode=disable"), None).unwrap()
}

#[tokio::test(start_paused = true)]
async fn nobody_waits_longer_for_a_silent_server_than_is_said() {
    let store = Store::open(&mute().await).await.unwrap();
    let study = study("unheard", 1);
    let id = &study.id;
    let began = Instant::now();
    let answers = tokio::join!(
        async { store.create(&study).await.map(drop) },
        store.touch(id),
        store.cancel(id),
        store.resume(id, LEASE),
        store.forget(id),
        async { store.find(id).await.map(drop) },
        async { store.waiting().await.map(drop) },
        async { store.figures().await.map(drop) },
    );
    let said = "did not answer within 10 s";
    assert!(began.elapsed() < Duration::from_secs(11), "{:?}", began.elapsed());
    let answers: [_; 8] = answers.into();
    for answer in answers {
        let error = answer.unwrap_err();
        assert!(matches!(error, StoreError::Silent(_)) && error.to_string().contains(said), "{error}");
    }
}

#[test]
fn an_address_holds_no_password_and_shows_none() {
    for text in ["postgres://me:secret@db/studies", "postgresql://db/studies?sslmode=require&password=secret"] {
        assert_eq!(Address::new(text, None).unwrap_err(), AddressError::HoldsPassword);
    }
    let address = Address::new("postgres://me@db:5433/studies?sslmode=verify-full", Some("secret")).unwrap();
    assert!(address.is_shared());
    assert_eq!(
        (address.to_string(), format!("{address:?}")),
        ("postgres://db:5433/studies".into(), "postgres://db:5433/studies".into())
    );
    assert!(!Address::new("/var/lib/toothwave/studies.sqlite", None).unwrap().is_shared());
}

/// SQLite keeps what is in these nowhere, or elsewhere than it is said.
#[test]
fn an_address_of_no_file_and_no_server_is_refused() {
    for text in ["", ":memory:", "file:studies?mode=memory"] {
        assert_eq!(Address::new(text, None).unwrap_err(), AddressError::NoFile(text.into()));
    }
    assert!(Address::new("./file:studies", None).is_ok());
}

/// Whoever computes the first one may learn late, or never, that it is gone.
#[tokio::test]
async fn a_chunk_of_a_study_that_was_begun_anew_and_cut_otherwise_is_none_of_its_chunks() {
    with_each_store(async |store| {
        let first = study("cut", 3);
        store.create(&first).await.unwrap();
        let mut lost = claimed(&store, &first).await;
        // As when its lease is over: one that is held on a server keeps the study from being forgotten.
        if store.address().is_shared() {
            lost.keep(&[1], 7, 0, BUSY).await.unwrap();
        }
        gone(&store, &first).await;
        let second = NewStudy { chunk_variants: 21, chunks: 1, ..first.clone() };
        assert!(store.create(&second).await.unwrap());
        lost.keep(&[1], 7, 0, BUSY).await.unwrap();
        assert_eq!(store.find(&first.id).await.unwrap().unwrap().done, 0);
        assert!(matches!(store.claim(&first.cut(), LEASE).await.unwrap(), Claim::None));
        drop(lost);
        let mut lease = claimed(&store, &second).await;
        lease.keep(&[2], 21, 0, BUSY).await.unwrap();
        assert!(store.find(&first.id).await.unwrap().unwrap().is_done());
        // Nor does anybody read them who knows the first one.
        assert_eq!(
            (store.chunks_done(&first.cut()).await.unwrap(), store.parts(&first.cut(), 0, 0).await.unwrap()),
            (vec![], vec![])
        );
        assert_eq!(store.chunks_done(&second.cut()).await.unwrap(), [(0, 1)]);
        gone(&store, &first).await;
    })
    .await;
}

#[tokio::test]
async fn a_study_that_is_asked_for_again_while_it_is_to_be_forgotten_is_kept() {
    let Some(address) = server() else { return };
    let _others = SERVER.read().await;
    let (service, worker) = (migrated(&address).await, Store::open(&address).await.unwrap());
    let study = study("wanted", 1);
    service.create(&study).await.unwrap();
    let lease = claimed(&worker, &study).await;
    service.cancel(&study.id).await.unwrap();
    let (forgotten, ()) = tokio::join!(service.forget(&study.id), async {
        worker.resume(&study.id, LEASE).await.unwrap();
    });
    forgotten.unwrap();
    lease.give_back().await.unwrap();
    assert!(service.find(&study.id).await.unwrap().unwrap().is_running());
    gone(&service, &study).await;
}

/// As one does that stands still.
#[tokio::test]
async fn a_worker_that_does_not_let_go_holds_up_whoever_forgets_its_study_and_nobody_else() {
    let Some(address) = server() else { return };
    let _others = SERVER.read().await;
    let (service, worker) = (migrated(&address).await, Store::open(&address).await.unwrap());
    let study = study("still", 1);
    service.create(&study).await.unwrap();
    let lease = claimed(&worker, &study).await;
    service.cancel(&study.id).await.unwrap();
    assert!(matches!(service.forget(&study.id).await, Err(StoreError::InWork)));
    // More than there are connections.
    let forgetting: Vec<_> = (0..20)
        .map(|_| {
            let (service, id) = (service.clone(), study.id.clone());
            tokio::spawn(async move { service.forget(&id).await })
        })
        .collect();
    for _ in 0..20 {
        assert!(service.find(&study.id).await.unwrap().is_some());
        tokio::task::yield_now().await;
    }
    lease.give_back().await.unwrap();
    for forgotten in forgetting {
        // Where everything is slow its patience may be over by now.
        let forgotten = forgotten.await.unwrap();
        assert!(matches!(forgotten, Ok(()) | Err(StoreError::InWork)), "{forgotten:?}");
    }
    gone(&service, &study).await;
    assert_eq!(service.find(&study.id).await.unwrap(), None);
}

/// Polls a future so often at most; whether it came to an end.
async fn polled(future: impl Future, times: usize) -> bool {
    let mut future = std::pin::pin!(future);
    let mut polls = 0;
    std::future::poll_fn(|context| {
        if polls == times {
            return Poll::Ready(false);
        }
        polls += 1;
        future.as_mut().poll(context).map(|_| true)
    })
    .await
}

/// As a client does that asks for a study and goes away: wherever that leaves a connection, nobody else finds it there.
#[tokio::test]
async fn whoever_leaves_in_the_middle_of_anything_leaves_no_transaction_open() {
    with_each_store(async |store| {
        let mut times = 1;
        loop {
            // So many that it is left among them.
            let (left, other) = (study(&format!("left-{times}"), 50_000), study(&format!("other-{times}"), 3));
            let is_whole = polled(store.create(&left), times).await;
            store.cancel("none").await.unwrap();
            for study in [&other, &left] {
                store.create(study).await.unwrap();
                let waiting = store.waiting().await.unwrap();
                assert!(waiting.iter().any(|waiting| waiting.cut.id == study.id), "{times}: {}", study.id);
                gone(&store, study).await;
            }
            if is_whole {
                break;
            }
            times += 1;
        }
        assert!(times > 1, "it was never left in the middle");
    })
    .await;
}

#[tokio::test]
async fn a_study_that_is_forgotten_while_its_chunk_is_claimed_has_none_and_holds_nobody_up() {
    with_each_store(async |store| {
        for round in 0..20 {
            let study = study(&format!("gone-{round}"), 3);
            store.create(&study).await.unwrap();
            // One that runs is somebody's who asked for it anew, and stays.
            store.cancel(&study.id).await.unwrap();
            let worked = async {
                if let Claim::Chunk(mut lease) = store.claim(&study.cut(), LEASE).await.unwrap() {
                    keep(&mut lease).await;
                }
            };
            let ((), forgotten) = tokio::join!(worked, store.forget(&study.id));
            forgotten.unwrap();
            assert_eq!(store.find(&study.id).await.unwrap(), None);
        }
    })
    .await;
}
