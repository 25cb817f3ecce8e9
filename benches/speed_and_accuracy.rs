//! Speed against error, from real runs: `cargo bench --bench speed_and_accuracy` writes benches/results/speed-and-accuracy.md with its plots.
//!
//! With `-- --quick` everything runs once and small, and the report stays beside the build.

mod baselines;
mod harness;
#[path = "harness/models.rs"]
mod models;
#[path = "harness/plot.rs"]
mod plot;
#[path = "harness/reference.rs"]
mod reference;
#[path = "harness/turns.rs"]
mod turns;

use std::fmt::Write as _;
use std::fs;
use std::hint::black_box;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use baselines::paper::{Method, Paper};
use baselines::{COLUMNS, Case, Columns, dense, newton};
use harness::{Effort, Spread, machine, three_digits};
use mimalloc::MiMalloc;
use plot::{Plot, Series};
use reference::{Reference, Setup};
use toothwave_solver::drive::Drive;
use toothwave_solver::load_sharing::LoadCase;
use toothwave_solver::mesh::Mesh;
use toothwave_solver::sweep::{Points, Sweep, sweep, sweep_plain};
use toothwave_solver::{Never, SolveError, Stop};
use turns::{BATCH, Contestant, Failure, take_turns};

/// The service's allocator.
#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

/// As many states as a tolerance may take.
const MAX_STATES: u64 = 10_000_000;

/// Smaller errors are drawn here: the last digit of a double.
const LEAST_DRAWN_ERROR: f64 = 1e-16;

type SweepFunction = fn(&Drive, &LoadCase, Points, &dyn Stop) -> Result<Sweep, SolveError>;

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().collect();
    if let [_, flag, intervals] = arguments.as_slice()
        && flag == CHILD_FLAG
    {
        return scaling_child(intervals.parse()?);
    }
    let effort = Effort::of(&arguments);
    if let Some(at) = arguments.iter().position(|argument| argument == "--models") {
        let only = arguments.get(at + 1).map_or("", String::as_str);
        models::table(effort, if only.starts_with("--") { "" } else { only })?;
        return Ok(());
    }
    let directory = effort.directory();
    fs::create_dir_all(directory.join(PLOTS))?;
    let reference = Reference::read()?;
    let mut paper = Paper::start().inspect_err(|error| println!("no NumPy baseline: {error}")).ok();

    let mut report = introduction(paper.as_ref());
    report += "\n## Case 5.1 against the baselines\n\n";
    report += BASELINES;
    for (intervals, rounds) in [(50, effort.choose(31, 3)), (5000, effort.choose(11, 3))] {
        report += &against_baselines(&reference, paper.as_mut(), intervals, rounds)?;
    }
    drop(paper);
    report += &models::table(effort, "")?;
    report += &scaling(effort, &directory)?;
    report += &error_over_time(effort, &directory, &reference)?;
    let path = directory.join("speed-and-accuracy.md");
    fs::write(&path, report)?;
    println!("written: {}", path.display());
    Ok(())
}

/// Where the plots stand, beside the report.
const PLOTS: &str = "speed-and-accuracy";

fn introduction(paper: Option<&Paper>) -> String {
    format!(
        "# Speed and accuracy\n\n\
         Written by `cargo bench --bench speed_and_accuracy`; run it again for your machine. The whole request over HTTP is measured in \
         [speed-http.md](speed-http.md).\n\n\
         ## Method\n\n\
         - *From a cold drive*: a run starts at the parameters (`Drive::new`, `LoadCase::new`) and ends with all twelve columns of the API in \
         memory. toothwave's runs also check the parameters against each other and find peaks, wind-up, stiffness and residuals; the baselines compute the \
         columns and nothing else.\n\
         - One thread. All contestants of a table run in one process (Python in one beside it, without its start) and take turns: in each round each of them \
         runs a batch of at least {} ms, one run where that takes longer, and the round starts with another one each time. A number is the median over the \
         rounds, with the quartiles in brackets. A ratio is the median of the rounds' ratios.\n\
         - *Error*: the largest difference from the calculation to 40 digits (tests/reference), over the column's peak, over all eleven columns of numbers \
         and {} states of case 5.1. Those states are among the 5000 intervals too.\n\n\
         ## Machine\n\n{}{}\n",
        BATCH.as_millis(),
        "24",
        machine().replace(" | ", ".\n"),
        paper.map(|paper| format!(".\n{}.", paper.versions)).unwrap_or_default(),
    )
}

const BASELINES: &str = "\
    - (i) [newton.rs](../baselines/newton.rs): the same formulas with a Newton solve and libm calls at each state.\n\
    - (ii) [dense.rs](../baselines/dense.rs): the geometry of (i); the paper's 3n equations assembled and solved by nalgebra's LU at each input angle.\n\
    - (iii) [paper.py](../baselines/paper.py): the paper's method as a plain NumPy script, Newton's method tooth by tooth; and once more with \
    all teeth of an input angle in one array, which is the kindest to NumPy.\n\
    - *plain path*: toothwave's own solver state by state, the oracle of the fast path.\n";

fn from_cold(setup: &Setup, points: Points, sweep: SweepFunction) -> Result<Sweep, Failure> {
    let setup = black_box(setup);
    let drive = Drive::new(&setup.drive)?;
    let load = LoadCase::new(&setup.load).map_err(|violations| format!("{violations:?}"))?;
    Ok(sweep(&drive, &load, points, &Never)?)
}

fn columns_of(sweep: Sweep) -> Columns {
    let states = sweep.states;
    Columns {
        tooth: states.tooth.into_iter().map(i64::from).collect(),
        values: [
            states.input_angle_deg,
            states.position_deg,
            states.center_radius_mm,
            states.wave_generator_angle_deg,
            states.ring_angle_deg,
            states.force_n.wave_generator,
            states.force_n.ring,
            states.force_n.carrier,
            states.stress_mpa.wave_generator,
            states.stress_mpa.ring,
            states.stress_mpa.carrier,
        ],
    }
}

/// The largest difference of the columns of two sweeps, over each column's peak.
fn largest_difference(columns: &Columns, others: &Columns) -> f64 {
    assert_eq!(columns.tooth, others.tooth, "the same teeth mesh");
    let of_column = |(column, other): (&Vec<f64>, &Vec<f64>)| {
        let peak = other.iter().copied().fold(0.0, f64::max);
        column.iter().zip(other).map(|(value, other)| (value - other).abs() / peak).fold(0.0, f64::max)
    };
    columns.values.iter().zip(&others.values).map(of_column).fold(0.0, f64::max)
}

fn against_baselines(
    reference: &Reference,
    paper: Option<&mut Paper>,
    intervals: i64,
    rounds: usize,
) -> Result<String, Failure> {
    let setup = reference.setup("5.1 projection")?;
    let samples = Points::samples(intervals.unsigned_abs()).map_err(|violation| violation.to_string())?;
    let case =
        Case { drive: setup.drive, material: setup.load.materials.teeth, input_torque_nm: setup.input_torque_nm };
    let case = black_box(&case);
    // Two contestants share the one Python.
    let paper = paper.map(std::cell::RefCell::new);
    let with_paper = |method| paper.as_ref().map(|paper| (method, paper));

    let mut answers = vec![
        columns_of(from_cold(&setup, samples, sweep)?),
        columns_of(from_cold(&setup, samples, sweep_plain)?),
        newton::sweep(case, intervals),
        dense::sweep(case, intervals),
    ];
    let mut contestants = vec![
        Contestant::of("toothwave", || from_cold(&setup, samples, sweep)),
        Contestant::of("toothwave, plain path", || from_cold(&setup, samples, sweep_plain)),
        Contestant::of("(i) Newton and libm", || Ok(newton::sweep(case, intervals))),
        Contestant::of("(ii) 3n equations by LU", || Ok(dense::sweep(case, intervals))),
    ];
    let mut goals =
        if intervals == 50 { vec![None, None, Some(5), Some(12)] } else { vec![None, None, Some(10), Some(20)] };
    let scripts = [
        ("(iii) NumPy", Method::ToothByTooth, Some(if intervals == 50 { 1500 } else { 2000 })),
        ("(iii) NumPy, all teeth at once", Method::AllAtOnce, None),
    ];
    for (name, method, goal) in scripts {
        if let Some((method, paper)) = with_paper(method) {
            answers.push(paper.borrow_mut().sweep(method, intervals)?);
            let run = move |runs| paper.borrow_mut().time(method, intervals, runs);
            contestants.push(Contestant::new(name, Box::new(run)));
            goals.push(goal);
        }
    }
    take_turns(&mut contestants, rounds)?;

    let states = answers[0].tooth.len();
    let mut text = format!("\n### {intervals} intervals, {states} states\n\n");
    text += "| | ns a state | toothwave is faster | goal | largest error | in column | largest difference from the plain path |\n";
    text += "|---|---|---|---|---|---|---|\n";
    let fastest = contestants[0].seconds.clone();
    for ((contestant, answer), goal) in contestants.iter().zip(&answers).zip(goals) {
        let speed = contestant.spread(1e9 / states as f64);
        let ratios = Spread::of(contestant.seconds.iter().zip(&fastest).map(|(seconds, fastest)| seconds / fastest));
        let ratio = if contestant.name == "toothwave" { String::new() } else { format!("{} times", ratios.show(1.0)) };
        let goal = match goal {
            Some(times) => format!("{times} times"),
            None if contestant.name == "toothwave" && intervals == 5000 => "20 ns".into(),
            None => String::new(),
        };
        let (error, column) = reference.largest_error("5.1 projection", answer, intervals)?;
        let difference = largest_difference(answer, &answers[1]);
        let column = COLUMNS[column];
        writeln!(
            text,
            "| {} | {} | {ratio} | {goal} | {error:.1e} | {column} | {difference:.1e} |",
            contestant.name,
            speed.show(1.0)
        )?;
    }
    println!("{text}");
    if paper.is_none() {
        text += "\n(iii) was not measured: there was no Python with NumPy.\n";
    }
    Ok(text)
}

/// Starts this program as the child that [`scaling_child`] is.
const CHILD_FLAG: &str = "--one-size";

/// Sweeps one size in a process of its own, whose peak memory is then that of this size, and prints states, seconds and bytes.
fn scaling_child(intervals: u64) -> Result<(), Failure> {
    let setup = Setup::PAPER_5_1;
    let points = Points::samples(intervals).map_err(|violation| violation.to_string())?;
    let before = memory_bytes("VmRSS")?;
    let mut seconds = Vec::new();
    let mut states = 0;
    let started = Instant::now();
    // A second for those that are over at once, three runs for those that are not.
    while seconds.len() < 3 || started.elapsed() < Duration::from_millis(200) {
        let run = Instant::now();
        let sweep = from_cold(&setup, points, sweep)?;
        seconds.push(run.elapsed().as_secs_f64());
        states = black_box(sweep).states.len();
    }
    let peak = memory_bytes("VmHWM")? - before;
    println!("{states} {} {peak}", Spread::of(seconds).median);
    Ok(())
}

/// A line of the kernel's account of this process's memory.
fn memory_bytes(name: &str) -> Result<f64, Failure> {
    let status = fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'));
    let kibibytes: f64 = line.ok_or("no such line")?.trim().trim_end_matches("kB").trim().parse()?;
    Ok(1024.0 * kibibytes)
}

fn scaling(effort: Effort, directory: &Path) -> Result<String, Failure> {
    let sizes: &[u64] =
        effort.choose(&[143, 452, 1428, 4518, 14_285, 45_175, 142_857, 451_750, 1_428_571], &[143, 1428, 14_285]);
    let rounds = effort.choose(5, 1);
    let mut measured = vec![Vec::new(); sizes.len()];
    for _ in 0..rounds {
        for (size, measured) in sizes.iter().zip(&mut measured) {
            let output = Command::new(std::env::current_exe()?).args([CHILD_FLAG, &size.to_string()]).output()?;
            let line = String::from_utf8(output.stdout)?;
            let numbers: Vec<f64> = line.split_whitespace().map(str::parse).collect::<Result<_, _>>()?;
            let [states, seconds, bytes] = numbers.as_slice() else { return Err("a child failed".into()) };
            measured.push((*states, *seconds, *bytes));
        }
    }
    let mut text = String::from(
        "\n## Cost over the number of states\n\nCase 5.1, each size in a process of its own; memory is that process's peak, less what it had before the sweep.\n\n\
         | states | ms | ns a state | bytes a state |\n|---|---|---|---|\n",
    );
    let mut points = Vec::new();
    for measured in &measured {
        let states = measured[0].0;
        let seconds = Spread::of(measured.iter().map(|(_, seconds, _)| *seconds));
        let bytes = Spread::of(measured.iter().map(|(_, _, bytes)| *bytes)).median / states;
        writeln!(text, "| {states} | {} | {} | {bytes:.0} |", seconds.show(1e-3), seconds.show(1e-9 * states))?;
        points.push((states, seconds.median));
    }
    let exponent = slope_in_logarithms(&points);
    writeln!(
        text,
        "\nTime grows with the power {exponent:.3} of the number of states (least squares in the logarithms); 1 is linear. The columns that the API \
         shows take 92 bytes a state, those of the input angles 4.\n\n![Time over states]({PLOTS}/scaling.svg)"
    )?;
    let drawn: Vec<_> = points.iter().map(|(states, seconds)| (*states, 1e3 * seconds)).collect();
    let linear = drawn.iter().map(|(states, _)| (*states, drawn[0].1 / drawn[0].0 * states)).collect();
    Plot {
        title: "Case 5.1: time over the number of states",
        x_label: "states",
        y_label: "ms",
        decades_per_tick: 1.0,
        series: vec![Series::line("linear", linear), Series::points("toothwave", drawn)],
    }
    .write(&directory.join(PLOTS).join("scaling.svg"))?;
    println!("{text}");
    Ok(text)
}

fn slope_in_logarithms(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let logarithms = || points.iter().map(|(x, y)| (x.ln(), y.ln()));
    let (mean_x, mean_y) =
        (logarithms().map(|(x, _)| x).sum::<f64>() / count, logarithms().map(|(_, y)| y).sum::<f64>() / count);
    let covariance: f64 = logarithms().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    covariance / logarithms().map(|(x, _)| (x - mean_x) * (x - mean_x)).sum::<f64>()
}

/// Which cases the error is shown over time for: title, name of the plot, name in the reference.
const CASES_OVER_TIME: [(&str, &str, &str); 5] = [
    ("Case 5.1", "case-5.1", "5.1 projection"),
    ("Case 5.2: undercut", "case-5.2", "5.2 projection"),
    ("Case 5.2, bored", "case-5.2-bored", "5.2 bored projection"),
    ("Hard: case 5.1 with a radius 1e-6 above the threshold of undercut", "undercut-threshold", "5.1, 1e-6 above"),
    ("Hard: nearly round, (a - b)/a = 1e-6", "nearly-round", "1e-6 projection"),
];

const SAMPLES: [u64; 9] = [10, 20, 50, 100, 200, 500, 1000, 2000, 5000];

const TOLERANCES: [f64; 9] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10];

fn six_peaks(sweep: &Sweep) -> [f64; 6] {
    let peaks = &sweep.peaks;
    let [h, k, s] =
        [&peaks.wave_generator, &peaks.ring, &peaks.carrier].map(|peaks| [peaks.force_n.value, peaks.stress_mpa.value]);
    [h[0], h[1], k[0], k[1], s[0], s[1]]
}

fn error_over_time(effort: Effort, directory: &Path, reference: &Reference) -> Result<String, Failure> {
    let mut text = String::from(
        "\n## Error over time\n\nWays to ask for the six peaks (three forces, three stresses): so many equal intervals, or a tolerance. Error is the largest relative one \
         of the six, against the same sweep with the tolerance 1e-12; time is from a cold drive. In the plots an error below 1e-16 stands at 1e-16.\n",
    );
    let by_samples = SAMPLES.map(|samples| (format!("{samples} intervals"), Points::samples(samples)));
    let to_tolerance = TOLERANCES.map(|value| (format!("tolerance {value:.0e}"), Points::tolerance(value, MAX_STATES)));
    let ladder = by_samples.into_iter().chain(to_tolerance);
    let ladder: Result<Vec<_>, _> = ladder.map(|(name, points)| points.map(|points| (name, points))).collect();
    let ladder = ladder.map_err(|violation| violation.to_string())?;
    for (title, file, name) in CASES_OVER_TIME {
        let setup = reference.setup(name)?;
        let converged = six_peaks(&from_cold(&setup, Points::finest(MAX_STATES), sweep)?);
        let mut contestants: Vec<_> =
            ladder.iter().map(|(name, points)| Contestant::of(name, || from_cold(&setup, *points, sweep))).collect();
        take_turns(&mut contestants, effort.choose(15, 1))?;
        let mesh = Mesh::new(&Drive::new(&setup.drive)?).coincidence_degree();
        write!(text, "\n### {title}\n\n![{title}: error over time]({PLOTS}/{file}.svg)\n\n")?;
        writeln!(
            text,
            "Coincidence degree {mesh:.6}.\n\n| | states | µs | largest error of a peak |\n|---|---|---|---|"
        )?;
        let (mut by_samples, mut by_tolerance) = (Vec::new(), Vec::new());
        for ((name, points), contestant) in ladder.iter().zip(&contestants) {
            let sweep = from_cold(&setup, *points, sweep)?;
            let error = six_peaks(&sweep)
                .iter()
                .zip(&converged)
                .map(|(peak, converged)| (peak - converged).abs() / converged)
                .fold(0.0, f64::max);
            let time = contestant.spread(1e6);
            writeln!(text, "| {name} | {} | {} | {error:.1e} |", sweep.states.len(), time.show(1.0))?;
            let drawn = (time.median, error.max(LEAST_DRAWN_ERROR));
            match points {
                Points::Samples(_) => by_samples.push(drawn),
                Points::Tolerance(_) => by_tolerance.push(drawn),
            }
        }
        Plot {
            title,
            x_label: "solve time in µs",
            y_label: "largest relative error of a peak",
            decades_per_tick: 2.0,
            series: vec![Series::points("equal intervals", by_samples), Series::points("tolerance", by_tolerance)],
        }
        .write(&directory.join(PLOTS).join(format!("{file}.svg")))?;
        println!("{title}: {} ms in the longest way", three_digits(1e3 * longest(&contestants)));
    }
    Ok(text)
}

fn longest(contestants: &[Contestant<'_>]) -> f64 {
    contestants.iter().map(|contestant| contestant.spread(1.0).median).fold(0.0, f64::max)
}
