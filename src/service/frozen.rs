//! What is frozen with a study that is kept in a store: its chunks, and a canary that tells whether another process computes the same bits.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};
use toothwave_calculation::no_answer::NoAnswer;
use toothwave_calculation::{BUILD, origin, question};
use toothwave_store::{Cut, NewStudy, Store};
use toothwave_study::{Interrupted, Limits, Part, Study, Work};

use crate::compute::{Lane, Pool, SMALL_VARIANT_BYTES, Slice};
use crate::problem::{Problem, ProblemCode};

/// What a chunk should take: long against what it costs to claim and to keep one, short against what a worker's end loses.
const CHUNK: Duration = Duration::from_secs(1);

/// Chunks of a study at most, though each takes longer then: whoever reads its result goes through a list of them.
const MOST_CHUNKS: u64 = 100_000;

/// And at least, where not all of its variants were seen before.
const LEAST_CHUNKS: u64 = 64;

/// A canary is long enough to tell how long variants take.
const CANARY: Duration = Duration::from_millis(50);

/// Variants of a canary at most.
const MOST_OF_A_CANARY: u64 = 4096;

/// Bytes of what a chunk comes to, at most: one statement carries them.
const MOST_OF_A_PART: u64 = 4 << 20;

/// Bytes of a chunk's rows as they are kept besides, at most: they have all inputs, of which there may be hundreds.
const MOST_OF_ROWS: u64 = 8 << 20;

/// A worker is not taken for dead before it was silent for so long. One that computes is not silent, however long its chunk takes.
const LEASE: Duration = Duration::from_secs(30);

/// Why a stored study is not computed here.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NotHere {
    /// The build is part of the study.
    #[error("the study belongs to build {theirs}, and this is {BUILD}")]
    OtherBuild {
        /// The one that it was asked of.
        theirs: String,
    },
    /// So is the arithmetic of its processor.
    #[error("the study was asked of another kind of processor, whose last bits are others")]
    OtherArithmetic,
    /// Whatever the reason.
    #[error("the study's canary comes to other bits here")]
    OtherBits,
    /// This process has not the memory for it.
    #[error(
        "it takes some {bytes} bytes while it is read, or a variant is computed, and the memory here has room for {most_bytes}"
    )]
    NeedsMemory {
        /// About what its document takes, or one of its variants.
        bytes: u64,
        /// What that may be here.
        most_bytes: u64,
    },
    /// This build knows no such study, though it is its own.
    #[error("the study cannot be read: {0}")]
    Unreadable(String),
}

/// A study in the chunks that it is computed in, and all that is frozen with it when it is first kept.
///
/// # Errors
/// Where the canary has no turn, or the service stops.
pub async fn freeze(
    pool: &Pool,
    study: Study,
    document: &[u8],
    limits: &question::Limits,
    time: Duration,
) -> Result<(Arc<Study>, NewStudy), Problem> {
    let study = Arc::new(study);
    // What was admitted here is computed here, alone if it has to be.
    let canary = sung(pool, Canary::new(&study, MOST_OF_A_CANARY, Some(CANARY)), u64::MAX).await?;
    let canary = canary.map_err(|reason| Problem::internal(&reason))?;
    let canary_variants = canary.sung.max(1);
    let a_variant = canary.busy / u32::try_from(canary_variants).unwrap_or(u32::MAX);
    let part_variants = MOST_OF_A_PART / (study.stored_bytes() / study.variants().max(1)).max(1);
    let part_variants = part_variants.min(MOST_OF_ROWS / study.row_bytes().max(1));
    let wanted = u64::try_from(CHUNK.as_nanos() / a_variant.as_nanos().max(1)).unwrap_or(u64::MAX);
    // Of what a canary has not seen some may take far longer: whatever that is, little of the study is lost with one chunk.
    let most = if canary_variants < study.variants() { study.variants().div_ceil(LEAST_CHUNKS) } else { u64::MAX };
    let wanted = wanted.min(most).max(study.variants().div_ceil(MOST_CHUNKS));
    #[cfg(feature = "fault-injection")]
    let wanted = crate::injected::chunk_variants().unwrap_or(wanted);
    let id = study.id().to_string();
    let canary = canary.hash();
    let study = Arc::into_inner(study).ok_or_else(|| Problem::internal(&"a canary goes on after its end"))?;
    let study = study.in_chunks_of(wanted.min(part_variants).max(1));
    let frozen = NewStudy {
        id,
        kind: study.kind().into(),
        origin: origin().into(),
        document: String::from_utf8_lossy(document).into_owned(),
        max_states: limits.max_states,
        max_profile_points: limits.max_profile_points,
        variants: study.variants(),
        chunk_variants: study.chunk_variants(),
        chunks: study.chunks(),
        canary_variants,
        canary,
        lease: LEASE,
        time,
    };
    Ok((Arc::new(study), frozen))
}

impl NotHere {
    /// The problem of whoever asks for the study by its id.
    pub fn told(&self, id: &str) -> Problem {
        match self {
            // The second is a worker's alone to say.
            Self::Unreadable(_) | Self::NeedsMemory { .. } => Problem::internal(self),
            // The same question is another study here.
            Self::OtherBuild { .. } | Self::OtherArithmetic | Self::OtherBits => {
                Problem::new(ProblemCode::NotFound, format!("no study `{id}` is known here: {self}; ask for it again"))
            }
        }
    }
}

/// That studies of this origin are computed here.
///
/// # Errors
/// Why they are not.
pub fn require_origin(theirs: &str) -> Result<(), NotHere> {
    let build = theirs.split('-').next().unwrap_or_default();
    if theirs == origin() {
        Ok(())
    } else if build == BUILD {
        Err(NotHere::OtherArithmetic)
    } else {
        Err(NotHere::OtherBuild { theirs: build.into() })
    }
}

/// About what a document of such a length takes besides while a study is read from it, at most: its tree, once as it stands and once sorted. What its choices
/// stand for is bounded, and not counted here.
pub const fn reading_bytes(document_bytes: u64) -> u64 {
    /// Measured with lists of numbers, texts and objects, each as short as can be.
    const TIMES: u64 = 64;
    document_bytes.saturating_mul(TIMES)
}

/// What is kept of a study besides its rows, about.
pub fn view_bytes(study: &Study) -> u64 {
    /// The study itself, what is noted of it, its places in lists.
    const OTHER_BYTES: u64 = 4096;
    OTHER_BYTES + study.kept_bytes() - study.stored_bytes()
}

/// The study that is kept as it was cut so, as it was frozen too, where it still is; or why it is none here. Its document is asked of the store when there is room for it.
///
/// # Errors
/// Where the store does not answer, reading it takes too long, or there is no room for that.
pub async fn thaw(
    pool: &Pool,
    store: &Store,
    cut: &Cut,
    document_bytes: u64,
) -> Result<Option<Result<(Arc<Study>, NewStudy), NotHere>>, Problem> {
    let deadline = pool.deadline();
    let room = pool.room_aside(deadline, document_bytes.saturating_add(reading_bytes(document_bytes)), 0).await?;
    let Some(found) = store.find(&cut.id).await?.filter(|found| found.study.cut() == *cut) else { return Ok(None) };
    let thaw = move || {
        let _room = room;
        Ok(Some(thawed(&found.study).map(|study| (study, found.study))))
    };
    pool.run_aside(deadline, document_bytes, thaw).await
}

fn thawed(frozen: &NewStudy) -> Result<Arc<Study>, NotHere> {
    require_origin(&frozen.origin)?;
    let calculation = question::Limits { max_states: frozen.max_states, max_profile_points: frozen.max_profile_points };
    // Whoever took it on admitted as much.
    let limits = Limits { calculation, max_study_variants: u64::MAX, max_study_bytes: u64::MAX };
    let study = Study::read(frozen.document.as_bytes(), &limits)
        .map_err(|refused| NotHere::Unreadable(refused.to_string()))?
        .in_chunks_of(frozen.chunk_variants);
    if study.id().to_string() != frozen.id {
        return Err(NotHere::Unreadable("it has another id here".into()));
    }
    // What keeps it may be damaged, and the store does not see it: a study in other chunks than it was cut into would be done with some of them.
    let cut = |variants, chunks, chunk_variants| (variants, chunks, chunk_variants);
    if cut(study.variants(), study.chunks(), study.chunk_variants())
        != cut(frozen.variants, frozen.chunks, frozen.chunk_variants)
    {
        return Err(NotHere::Unreadable("it has other chunks here".into()));
    }
    Ok(Arc::new(study))
}

/// Why this process does not compute the study's bits, if it does not: those of its canary, of which no variant may take more than so many bytes.
///
/// # Errors
/// Where the canary has no turn, or the service stops.
pub async fn heard(
    pool: &Pool,
    study: &Arc<Study>,
    frozen: &NewStudy,
    most_bytes: u64,
) -> Result<Result<(), NotHere>, Problem> {
    let canary = sung(pool, Canary::new(study, frozen.canary_variants, None), most_bytes).await?;
    Ok(canary.and_then(|canary| if canary.hash() == frozen.canary { Ok(()) } else { Err(NotHere::OtherBits) }))
}

fn encoded(part: &Part) -> Result<Vec<u8>, Problem> {
    postcard::to_stdvec(part).map_err(|error| Problem::internal(&error))
}

/// What a chunk came to as it is kept: with what tells whether it is still that, since what keeps it may be damaged and the store does not see it.
pub fn sealed(cut: &Cut, chunk: u64, part: &Part) -> Result<Vec<u8>, Problem> {
    // As much as it comes to, about: one that grows would take twice as much.
    let room = part.bytes() + blake3::OUT_LEN;
    let mut bytes = postcard::to_extend(part, Vec::with_capacity(room)).map_err(|error| Problem::internal(&error))?;
    let seal = seal(cut, chunk, &bytes);
    bytes.extend_from_slice(seal.as_bytes());
    Ok(bytes)
}

/// The same as it was kept.
pub fn unsealed(cut: &Cut, chunk: u64, bytes: &[u8]) -> Result<Part, Problem> {
    let damaged =
        || Problem::internal(&format!("what chunk {chunk} of the study {} came to is damaged in its store", cut.id));
    let (bytes, kept) = bytes.split_last_chunk::<{ blake3::OUT_LEN }>().ok_or_else(damaged)?;
    if seal(cut, chunk, bytes) != *kept {
        return Err(damaged());
    }
    postcard::from_bytes(bytes).map_err(|error| Problem::internal(&error))
}

fn seal(cut: &Cut, chunk: u64, bytes: &[u8]) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    hasher.update(cut.id.as_bytes()).update(&cut.chunk_variants.to_le_bytes()).update(&chunk.to_le_bytes());
    hasher.update(bytes).finalize()
}

/// Time that this thread has had of a processor: a canary that had to stand aside for others would be cut in far too many chunks, for good.
fn processor_time() -> Duration {
    // It counts from the thread's start, and is never negative.
    clock_gettime(ClockId::ThreadCPUTime).try_into().unwrap_or_default()
}

/// The golden section of so many, or a little more: without a common divisor, so that steps of it lead to each, and in turn to every value of an axis that they
/// stand on.
fn stride(variants: u64) -> u64 {
    /// Of 2⁶⁴.
    const GOLDEN_SECTION: u128 = 0x9E37_79B9_7F4A_7C15;
    let least = u64::try_from((u128::from(variants) * GOLDEN_SECTION) >> 64).unwrap_or(0).max(1);
    (least..).find(|&stride| divisor(stride, variants) == 1).unwrap_or(1)
}

/// The greatest common one.
const fn divisor(mut one: u64, mut other: u64) -> u64 {
    while other != 0 {
        (one, other) = (other, one % other);
    }
    one
}

/// Variants spread over a study; of a search the beginning of its first island.
struct Canary {
    study: Arc<Study>,
    /// What its variants take while they are computed, as far as they were seen to.
    room_bytes: u64,
    island: Option<Work>,
    /// From one variant to the next.
    stride: u64,
    hasher: blake3::Hasher,
    sung: u64,
    most: u64,
    until: Option<Duration>,
    busy: Duration,
}

impl Canary {
    fn new(study: &Arc<Study>, most: u64, until: Option<Duration>) -> Self {
        let room_bytes = SMALL_VARIANT_BYTES;
        let island = (study.kind() == "search").then(|| Work::new(study, 0).within(room_bytes));
        let most = most.min(study.variants());
        let (stride, hasher) = (stride(study.variants()), blake3::Hasher::new());
        Self {
            study: Arc::clone(study),
            room_bytes,
            island,
            stride,
            hasher,
            sung: 0,
            most,
            until,
            busy: Duration::ZERO,
        }
    }

    /// Variants in an order whose every beginning is spread evenly: those at one end may be quick to refuse. Each comes once.
    fn variant(&self) -> u64 {
        let variants = u128::from(self.study.variants().max(1));
        u64::try_from(u128::from(self.sung) * u128::from(self.stride) % variants).unwrap_or(0)
    }

    /// As far as a slice allows; whether it is over.
    fn slice(&mut self, time: &mut Slice, stop: &AtomicBool) -> Result<bool, Problem> {
        let begun = processor_time();
        let busy = self.busy;
        let busy_now = || busy + processor_time().saturating_sub(begun);
        while self.sung < self.most && self.until.is_none_or(|until| self.sung == 0 || busy_now() < until) {
            let stepped = match &mut self.island {
                Some(island) => island.step(stop).map(|is_over| (is_over, None)),
                None => {
                    let variant = self.variant();
                    let work = Work::of_span(&self.study, variant..variant + 1).within(self.room_bytes);
                    work.run(stop).map(|part| (false, Some(part)))
                }
            };
            match stepped {
                Ok((is_over, part)) => {
                    if is_over {
                        self.most = self.sung + 1;
                    }
                    if let Some(part) = part {
                        self.hasher.update(&encoded(&part)?);
                    }
                }
                Err(Interrupted::Stopped) => return Err(NoAnswer::stopped().into()),
                Err(Interrupted::NeedsBytes(bytes)) => {
                    self.room_bytes = bytes;
                    self.island = self.island.take().map(|island| island.within(bytes));
                    self.busy = busy_now();
                    return Ok(false);
                }
            }
            self.sung += 1;
            if time.is_over() {
                self.busy = busy_now();
                return Ok(false);
            }
        }
        self.busy = busy_now();
        if let Some(island) = self.island.take() {
            self.hasher.update(&encoded(&island.finish())?);
        }
        Ok(true)
    }

    fn hash(self) -> String {
        self.hasher.finalize().to_hex().to_string()
    }
}

async fn sung(pool: &Pool, mut canary: Canary, most_bytes: u64) -> Result<Result<Canary, NotHere>, Problem> {
    let mut lane = Lane::default();
    while canary.room_bytes <= most_bytes {
        let is_over;
        (canary, is_over) = pool
            .run_variants(&mut lane, canary.room_bytes, move |time, stop| {
                let is_over = canary.slice(time, stop)?;
                Ok((canary, is_over))
            })
            .await?;
        if is_over {
            return Ok(Ok(canary));
        }
    }
    Ok(Err(NotHere::NeedsMemory { bytes: canary.room_bytes, most_bytes }))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::time::Duration;

    use clap::Parser as _;
    use serde_json::json;
    use toothwave_calculation::question;
    use toothwave_solver::Never;
    use toothwave_store::Cut;
    use toothwave_study::{Limits, Study, Work};

    use super::{Canary, MOST_OF_ROWS, freeze, sealed, unsealed};
    use crate::compute::Pool;
    use crate::config::Settings;

    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        settings: Settings,
    }

    const CALCULATION: question::Limits = question::Limits { max_states: 1_000_000, max_profile_points: 1_000_000 };
    const LIMITS: Limits = Limits { calculation: CALCULATION, max_study_variants: u64::MAX, max_study_bytes: u64::MAX };

    /// A chunk of short results and long rows, 144 MB of them, ended a worker of 128 MiB that kept them in a folder.
    #[tokio::test]
    async fn a_chunk_comes_to_few_bytes_of_rows_however_many_inputs_each_has() {
        const TEETH: usize = 500;
        let drive = json!({
            "wave_generator": { "kind": "harmonic_path", "lobes": 1, "mean_path_radius_mm": 1500.0, "amplitude_mm": 1.0 },
            "teeth": { "count": TEETH, "radius_mm": 2.0, "width_mm": 15.0 }, "ring": { "teeth": TEETH - 1 }
        });
        let deviates =
            |tooth| (format!("/deviations/tooth_radius_um/{tooth}"), json!({ "distribution": "uniform", "limit": 1 }));
        let inputs: serde_json::Map<_, _> = (0..TEETH).map(deviates).collect();
        let document = json!({
            "study": "tolerance", "base": { "drive": drive, "deviations": { "tooth_radius_um": vec![0.0; TEETH] } },
            "inputs": inputs, "quantities": ["outer_diameter_mm"], "samples": 2_000_000, "seed": 1
        });
        let document = document.to_string();
        let study = Study::read(document.as_bytes(), &LIMITS).expect("a study");
        let Line { settings } = Line::parse_from(["serve"]);
        let pool = Pool::new(settings.limits());
        let frozen = freeze(&pool, study, document.as_bytes(), &CALCULATION, Duration::MAX).await;
        let (study, frozen) = frozen.expect("a frozen study");
        assert_eq!(frozen.chunk_variants, MOST_OF_ROWS / study.row_bytes());
        let mut rows = Vec::new();
        let part = Work::new(&study, 0).run(&Never).expect("an answer");
        study.write_rows(&part, &mut rows).expect("rows");
        // What stands at the end of a file comes besides.
        assert!(rows.len() as u64 <= MOST_OF_ROWS * 5 / 4, "{}", rows.len());
    }

    /// A map of so many radii, each with two numbers of states.
    fn map_of(radii: u64) -> Arc<Study> {
        let base = include_str!("../../examples/paper-5.1.json");
        let over = format!(
            r#"{{ "/drive/teeth/radius_mm": {{ "min": 3, "max": 7, "steps": {radii} }}, "/sweep/samples": {{ "one_of": [16, 50] }} }}"#
        );
        let document =
            format!(r#"{{ "study": "map", "base": {base}, "over": {over}, "quantities": ["peak_stress_ring_mpa"] }}"#);
        Arc::new(Study::read(document.as_bytes(), &LIMITS).expect("a study"))
    }

    /// SQLite, and PostgreSQL by default, tell nothing of a bit that has become another: a number was 2e-308 instead of 4.5, in a study that was done.
    #[test]
    fn what_a_chunk_came_to_is_none_where_a_bit_of_it_is_another() {
        let part = Work::new(&map_of(5), 0).run(&Never).expect("an answer");
        let cut = |id: &str, chunk_variants| Cut { id: id.into(), chunk_variants };
        let one = cut("one", 100);
        let kept = sealed(&one, 7, &part).expect("it is kept");
        assert_eq!(unsealed(&one, 7, &kept).expect("and read"), part);
        for bit in 0..8 * kept.len() {
            let mut damaged = kept.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert!(unsealed(&one, 7, &damaged).is_err(), "{bit}");
        }
        assert!(unsealed(&one, 8, &kept).is_err() && unsealed(&cut("other", 100), 7, &kept).is_err());
        assert!(unsealed(&cut("one", 101), 7, &kept).is_err(), "in chunks of another size it is of other variants");
        assert!(unsealed(&one, 7, &kept[..20]).is_err());
    }

    #[test]
    fn every_beginning_of_a_canary_is_spread_over_a_study_and_sees_each_value_of_its_axes() {
        let mut canary = Canary::new(&map_of(8192), 4096, None);
        let mut seen = Vec::new();
        for begun in 0..4096_u64 {
            canary.sung = begun;
            seen.push(canary.variant());
            if begun % 64 == 63 {
                let share = |of: &dyn Fn(u64) -> bool| {
                    seen.iter().filter(|&&variant| of(variant)).count() as f64 / seen.len() as f64
                };
                assert!((0.4..0.6).contains(&share(&|variant| variant % 2 == 1)), "{begun}");
                for quarter in 0..4 {
                    assert!((0.2..0.3).contains(&share(&|variant| variant / 4096 == quarter)), "{begun}");
                }
            }
        }
    }

    #[test]
    fn a_canary_of_as_many_variants_as_there_are_sees_each_once() {
        for radii in [1, 2, 3, 5, 21, 50, 150, 1023, 2048] {
            let mut canary = Canary::new(&map_of(radii), 4096, None);
            let mut seen: Vec<_> = (0..canary.most)
                .map(|sung| {
                    canary.sung = sung;
                    canary.variant()
                })
                .collect();
            seen.sort_unstable();
            assert_eq!(seen, (0..2 * radii).collect::<Vec<_>>());
        }
    }
}
