//! Optimisers side by side: `optimisers evaluate PROBLEM` answers points of the unit cube, one a line, for others to optimise;
//! `optimisers own|heuropt|heuropt-islands PROBLEM EVALUATIONS SEED` optimises itself. Whatever keeps all limits is printed with the number of its evaluation.

use std::io::{self, BufRead as _, Write as _};
use std::sync::Mutex;

use heuropt::prelude::*;
use toothwave_solver::parts::RIM;
use toothwave_solver::sweep::{Points, peaks};
use toothwave_solver::{
    Compatibility, ContactLaw, Drive, DriveParameters, LoadCase, LoadParameters, Never, PerContact, ToothShape, Torque,
    WaveGenerator,
};

use crate::optimise::{Optimiser, Plan};
use crate::point::{Judged, Point};

// The product's own files, without all that stands around them.
#[allow(dead_code, reason = "objectives are two here")]
#[path = "../../../src/study/front.rs"]
mod front;
#[allow(dead_code, reason = "what a search merges is not asked for here")]
#[path = "../../../src/study/optimise.rs"]
mod optimise;
#[allow(dead_code, reason = "memory is not asked for here")]
#[path = "../../../src/study/point.rs"]
mod point;
#[allow(dead_code, reason = "the normal distribution is not asked for here")]
#[path = "../../../src/study/random.rs"]
mod random;

/// A problem over the unit cube: two objectives to be least, limits to be kept.
#[derive(Clone, Copy)]
enum Benchmark {
    /// That of docs/how-to/studies.md: ratio 20, 200 N·m, 120 mm, by the paper's model at 16 intervals.
    Drive,
    /// A. Osyczka, S. Kundu, Structural Optimization 10, 1995, 94-99.
    Osy,
    /// K. Deb, A. Pratap, S. Moitra, PPSN VI, 2000, 859-868.
    WeldedBeam,
}

impl Benchmark {
    fn named(name: &str) -> Self {
        match name {
            "drive" => Self::Drive,
            "osy" => Self::Osy,
            "welded-beam" => Self::WeldedBeam,
            other => panic!("no problem is called {other}"),
        }
    }

    const fn dimensions(self) -> usize {
        match self {
            Self::Drive => 5,
            Self::Osy => 6,
            Self::WeldedBeam => 4,
        }
    }

    const fn limits(self) -> usize {
        match self {
            Self::Drive => 4,
            Self::Osy => 6,
            Self::WeldedBeam => 4,
        }
    }

    /// What a point comes to; nothing where no drive can be.
    fn judged(self, place: &[f64]) -> Option<Judged> {
        match self {
            Self::Drive => drive(place),
            Self::Osy => Some(osy(place)),
            Self::WeldedBeam => Some(welded_beam(place)),
        }
    }
}

fn between(share: f64, low: f64, high: f64) -> f64 {
    low + share * (high - low)
}

fn drive(place: &[f64]) -> Option<Judged> {
    // The ranges that follow from the envelope, over the root radius.
    let root_mm = 60.0 / RIM;
    let count = 39 + i64::from(3.0 * place[2] >= 1.0) + i64::from(3.0 * place[2] >= 2.0);
    let parameters = DriveParameters {
        wave_generator: WaveGenerator::HarmonicPath {
            lobes: 2,
            mean_path_radius_mm: between(place[0], 0.4 * root_mm, root_mm),
            amplitude_mm: between(place[1], 0.002 * root_mm, 0.08 * root_mm),
        },
        teeth: count,
        installed: count,
        tooth_radius_mm: between(place[3], 0.02 * root_mm, 0.15 * root_mm),
        tooth: ToothShape::Cylinder { width_mm: between(place[4], 0.1 * root_mm, 0.6 * root_mm) },
        ring_teeth: count - 2,
        tip_radius_mm: None,
    };
    let load = LoadParameters {
        torque: Torque::Output(200.0),
        compatibility: Compatibility::Projection,
        law: ContactLaw::Linear,
        allowable_stress_mpa: Some(PerContact { wave_generator: 1500.0, ring: 1500.0, carrier: 1500.0 }),
        ..LoadParameters::default()
    };
    let drive = Drive::new(&parameters).ok()?;
    let load = LoadCase::new(&load).expect("a load");
    let points = Points::samples(16).expect("a number of samples");
    let diameter_mm = 2.0 * RIM * drive.root_radius_mm();
    let capacity_nm = peaks(&drive, &load, points, &Never).ok()?.torque_capacity?.output_torque_nm;
    let wall = drive.slot_wall_mm() / (2.0 * drive.slot_half_width_mm());
    let violations = vec![
        (diameter_mm - 120.0).max(0.0) / 120.0,
        (200.0 - capacity_nm).max(0.0) / 200.0,
        if drive.flank().is_undercut() { 1.0 } else { 0.0 },
        (0.25 - wall).max(0.0) / 0.25,
    ];
    Some(Judged { objectives: vec![diameter_mm, -capacity_nm], violations })
}

fn osy(place: &[f64]) -> Judged {
    let ranges = [(0.0, 10.0), (0.0, 10.0), (1.0, 5.0), (0.0, 6.0), (1.0, 5.0), (0.0, 10.0)];
    let x: Vec<_> = place.iter().zip(ranges).map(|(&share, (low, high))| between(share, low, high)).collect();
    let square = |x: f64| x * x;
    let first = -(25.0 * square(x[0] - 2.0)
        + square(x[1] - 2.0)
        + square(x[2] - 1.0)
        + square(x[3] - 4.0)
        + square(x[4] - 1.0));
    let second = x.iter().map(|&x| square(x)).sum();
    // Each at least zero, over its constant.
    let kept = [
        (x[0] + x[1] - 2.0) / 2.0,
        (6.0 - x[0] - x[1]) / 6.0,
        (2.0 - x[1] + x[0]) / 2.0,
        (2.0 - x[0] + 3.0 * x[1]) / 2.0,
        (4.0 - square(x[2] - 3.0) - x[3]) / 4.0,
        (square(x[4] - 3.0) + x[5] - 4.0) / 4.0,
    ];
    Judged { objectives: vec![first, second], violations: kept.map(|kept| (-kept).max(0.0)).to_vec() }
}

fn welded_beam(place: &[f64]) -> Judged {
    let [h, b] = [place[0], place[1]].map(|share| between(share, 0.125, 5.0));
    let [l, t] = [place[2], place[3]].map(|share| between(share, 0.1, 10.0));
    let cost = 1.104_71 * h * h * l + 0.048_11 * t * b * (14.0 + l);
    let deflection = 2.1952 / (t * t * t * b);
    let first_shear = 6000.0 / (2.0_f64.sqrt() * h * l);
    let arm = (0.25 * (l * l + (h + t) * (h + t))).sqrt();
    let second_shear =
        6000.0 * (14.0 + 0.5 * l) * arm / (2.0 * (0.707 * h * l * (l * l / 12.0 + 0.25 * (h + t) * (h + t))));
    let shear = (first_shear * first_shear + second_shear * second_shear + l * first_shear * second_shear / arm).sqrt();
    let bending = 504_000.0 / (t * t * b);
    let buckling = 64_746.022 * (1.0 - 0.028_234_6 * t) * t * b * b * b;
    let kept =
        [(13_600.0 - shear) / 13_600.0, (30_000.0 - bending) / 30_000.0, (b - h) / 5.0, (buckling - 6000.0) / 6000.0];
    Judged { objectives: vec![cost, deflection], violations: kept.map(|kept| (-kept).max(0.0)).to_vec() }
}

/// Counts evaluations, and prints those that keep all limits.
struct Counter {
    benchmark: Benchmark,
    count: Mutex<u64>,
}

impl Counter {
    fn judged(&self, place: &[f64]) -> Option<Judged> {
        let judged = self.benchmark.judged(place);
        let mut count = self.count.lock().expect("nobody panics");
        *count += 1;
        if let Some(judged) = &judged
            && judged.violations.iter().all(|&violation| violation <= 0.0)
        {
            println!("{count} {:?} {:?}", judged.objectives[0], judged.objectives[1]);
        }
        judged
    }
}

/// As many islands as a search of so many evaluations has.
const fn islands(evaluations: u64) -> u64 {
    let islands = evaluations / 12_500;
    if islands > 1 { islands } else { 1 }
}

/// The islands of a search, a point of each in turn.
fn own(counter: &Counter, evaluations: u64, seed: u64) {
    let benchmark = counter.benchmark;
    let islands = islands(evaluations);
    let each = evaluations / islands;
    let island = |island: u64| {
        let plan = Plan {
            dimensions: benchmark.dimensions(),
            limits: benchmark.limits(),
            scan_from: island * (each / 5 + 1),
            scan: each / 5,
            evaluations: each,
        };
        Optimiser::new(plan, Vec::new(), seed, island)
    };
    let mut optimisers: Vec<_> = (0..islands).map(island).collect();
    for _ in 0..each {
        for optimiser in &mut optimisers {
            let place = optimiser.ask();
            let point = counter.judged(&place).map(|judged| Point { place, judged, values: Vec::new() });
            optimiser.tell(point);
        }
    }
}

impl Problem for &Counter {
    type Decision = Vec<f64>;

    fn objectives(&self) -> ObjectiveSpace {
        ObjectiveSpace::new(vec![Objective::minimize("first"), Objective::minimize("second")])
    }

    fn evaluate(&self, place: &Vec<f64>) -> Evaluation {
        match self.judged(place) {
            Some(judged) => Evaluation::constrained(judged.objectives, judged.violations.iter().sum()),
            None => Evaluation::constrained(vec![0.0, 0.0], 1e6),
        }
    }
}

/// Points that are there already.
struct Given(Vec<Vec<f64>>);

impl Initializer<Vec<f64>> for Given {
    fn initialize(&mut self, count: usize, _: &mut heuropt::core::rng::Rng) -> Vec<Vec<f64>> {
        self.0.drain(..count).collect()
    }
}

/// NSGA-II after a scan of a fifth of the evaluations, of which the best begin.
fn nsga2_after_sobol(counter: &Counter, evaluations: u64, seed: u64) {
    const POPULATION: usize = 100;
    let dimensions = counter.benchmark.dimensions();
    let scan = u32::try_from(evaluations / 5).expect("few");
    let seed_of_scan = u32::try_from(seed).expect("small");
    let mut scanned: Vec<(f64, Vec<f64>)> = (0..scan)
        .map(|index| {
            let place: Vec<_> = (0..u32::try_from(dimensions).expect("few"))
                .map(|dimension| f64::from(sobol_burley::sample(index, dimension, seed_of_scan)))
                .collect();
            let violation = counter.judged(&place).map_or(1e6, |judged| judged.violations.iter().sum());
            (violation, place)
        })
        .collect();
    scanned.sort_by(|one, other| one.0.total_cmp(&other.0));
    let given = Given(scanned.into_iter().map(|(_, place)| place).collect());
    let bounds = vec![(0.0, 1.0); dimensions];
    let rest = usize::try_from(evaluations - u64::from(scan)).expect("few");
    let mut optimiser = Nsga2::new(
        Nsga2Config { population_size: POPULATION, generations: (rest / POPULATION).saturating_sub(1), seed },
        given,
        CompositeVariation {
            crossover: SimulatedBinaryCrossover::new(bounds.clone(), 15.0, 0.5),
            mutation: PolynomialMutation::new(bounds, 20.0, 1.0 / dimensions as f64),
        },
    );
    optimiser.run(&counter);
}

/// Objectives, then violations, of each line's point; of an impossible one `none`.
fn evaluate(benchmark: Benchmark) -> io::Result<()> {
    let mut output = io::stdout().lock();
    for line in io::stdin().lock().lines() {
        let line = line?;
        if line.is_empty() {
            output.flush()?;
            continue;
        }
        let place: Vec<f64> = line.split(' ').map(|share| share.parse().expect("a number")).collect();
        match benchmark.judged(&place) {
            Some(Judged { objectives, violations }) => {
                let numbers: Vec<_> =
                    objectives.iter().chain(&violations).map(|number| format!("{number:?}")).collect();
                writeln!(output, "{}", numbers.join(" "))?;
            }
            None => writeln!(output, "none")?,
        }
    }
    Ok(())
}

fn main() -> io::Result<()> {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    let words: Vec<_> = arguments.iter().map(String::as_str).collect();
    let counter = |name| Counter { benchmark: Benchmark::named(name), count: Mutex::new(0) };
    let number = |text: &str| text.parse().expect("a whole number");
    match words.as_slice() {
        ["evaluate", problem] => evaluate(Benchmark::named(problem))?,
        ["own", problem, evaluations, seed] => own(&counter(problem), number(evaluations), number(seed)),
        ["heuropt", problem, evaluations, seed] => {
            nsga2_after_sobol(&counter(problem), number(evaluations), number(seed));
        }
        // One after the other, each with a seed of its own: what they come to at the end tells, and not their course.
        ["heuropt-islands", problem, evaluations, seed] => {
            let (counter, evaluations, seed) = (counter(problem), number(evaluations), number(seed));
            let islands = islands(evaluations);
            for island in 0..islands {
                nsga2_after_sobol(&counter, evaluations / islands, 1000 * seed + island);
            }
        }
        _ => panic!("optimisers evaluate PROBLEM, or own|heuropt|heuropt-islands PROBLEM EVALUATIONS SEED"),
    }
    Ok(())
}
