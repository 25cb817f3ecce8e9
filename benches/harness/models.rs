//! Every model beside the plain path, which is what all but the first of them took before.

use std::fmt::Write as _;
use std::hint::black_box;

use toothwave_solver::drive::{Drive, DriveError};
use toothwave_solver::gaps::TipRelief;
use toothwave_solver::load_sharing::LoadCase;
use toothwave_solver::mesh::Mesh;
use toothwave_solver::sweep::{Points, peaks, sweep_plain, sweep_plain_with_deviations, sweep_with_deviations};
use toothwave_solver::{
    Compatibility, ContactLaw, Deviations, DriveParameters, LoadParameters, Modification, Never, PerContact,
    ToothShape, WaveGenerator,
};

use crate::harness::{Effort, Spread};
use crate::reference::Setup;
use crate::turns::{Contestant, Failure, take_turns};

const JOHNSON: ContactLaw = ContactLaw::JOHNSON;

/// The paper's case 5.2: undercut, every second slot filled.
const PAPER_5_2: DriveParameters = DriveParameters {
    wave_generator: WaveGenerator::Ellipse { semi_major_mm: 50.7, semi_minor_mm: 49.3 },
    teeth: 80,
    installed: 40,
    tooth_radius_mm: 1.5,
    tooth: ToothShape::Cylinder { width_mm: 15.0 },
    ring_teeth: 78,
    tip_radius_mm: None,
};

/// What is measured.
#[derive(Clone, Copy)]
enum Question {
    /// A sweep of 5000 intervals with all its columns, by state; where items deviate, of as many in all its load periods.
    Columns,
    /// The peaks of the same sweep, no column kept, by state.
    Unkept,
    /// The peaks of 16 intervals from the parameters, no column kept.
    Peaks,
    /// True peaks.
    TruePeaks,
    /// Whether a drive is refused, and by which codes.
    Refusal,
}

struct Row {
    name: &'static str,
    question: Question,
    drive: DriveParameters,
    load: LoadParameters,
    deviations: Deviations,
    goal: &'static str,
}

impl Row {
    /// The same with slots, teeth and the carrier off by a few micrometres, which the gaps cover.
    fn with_slots_that_deviate(mut self) -> Self {
        let off = |size: f64| (0..self.drive.installed).map(|slot| size * (2.4 * slot as f64).sin()).collect();
        self.deviations = Deviations {
            tooth_radius_um: off(1.0),
            slot_wall_um: off(1.5),
            slot_angle_arcsec: off(2.0),
            ..Deviations::default()
        };
        self.load.clearance_um = PerContact { wave_generator: 5.0, ring: 5.0, carrier: 5.0 };
        self
    }
}

fn rows() -> Vec<Row> {
    let Setup { drive, load, .. } = Setup::PAPER_5_1;
    let by_work = LoadParameters { compatibility: Compatibility::VirtualWork, ..load };
    let (palmgren, johnson) =
        (LoadParameters { law: ContactLaw::Palmgren, ..by_work }, LoadParameters { law: JOHNSON, ..by_work });
    let with_gaps = |load: LoadParameters| LoadParameters {
        clearance_um: PerContact { wave_generator: 0.0, ring: 10.0, carrier: 2.0 },
        ..load
    };
    let row = |name, question, drive, load, goal| {
        let deviations = Deviations::default();
        Row { name, question, drive, load, deviations, goal }
    };
    let relieved = |load: LoadParameters| {
        let ring_tip_relief = Some(TipRelief { amount_um: 8.0, start_deg: 60.0, power: 2.0 });
        LoadParameters { modification: Modification { ring_tip_relief, ..Modification::NONE }, ..load }
    };
    let undercut = |mut drive: DriveParameters| {
        // The threshold of case 5.1 and a millionth more.
        drive.tooth_radius_mm = 6.749_189_868_666_484 * (1.0 + 1e-6);
        drive
    };
    // Case 5.1's stroke and size.
    let on = |wave_generator: WaveGenerator| DriveParameters {
        wave_generator,
        ring_teeth: 28 - wave_generator.lobes(),
        ..drive
    };
    let eccentric = on(WaveGenerator::Eccentric { radius_mm: 57.0, eccentricity_mm: 1.0 });
    let harmonic = on(WaveGenerator::Harmonic { lobes: 2, mean_radius_mm: 57.0, amplitude_mm: 1.0 });
    let path = on(WaveGenerator::HarmonicPath { lobes: 2, mean_path_radius_mm: 62.0, amplitude_mm: 1.0 });
    let unlike = DriveParameters { teeth: 27, installed: 27, ring_teeth: 25, ..drive };
    let groove = Some(5.3);
    let groove_radius_mm = PerContact { wave_generator: groove, ring: groove, carrier: groove };
    let balls = DriveParameters { tooth: ToothShape::Ball { groove_radius_mm }, ..drive };
    let hertz = LoadParameters { law: ContactLaw::Hertz, ..by_work };
    let flats = DriveParameters { tooth: ToothShape::FlatSided { width_mm: 15.0, flat_length_mm: 4.0 }, ..drive };
    let allowable = Some(PerContact { wave_generator: 1500.0, ring: 1500.0, carrier: 1500.0 });
    use Question::{Columns, Peaks, Refusal, TruePeaks, Unkept};
    vec![
        row("`linear`", Columns, drive, load, "16"),
        row("allowable stress", Columns, drive, LoadParameters { allowable_stress_mpa: allowable, ..load }, "17"),
        row("`palmgren`", Columns, drive, palmgren, "28"),
        row("`linear`, gaps", Columns, drive, with_gaps(by_work), "25"),
        row("`palmgren`, gaps", Columns, drive, with_gaps(palmgren), "70"),
        row("`johnson`", Columns, drive, johnson, "50"),
        row("`johnson`, gaps", Columns, drive, with_gaps(johnson), "70"),
        row(
            "`johnson`, allowable stress",
            Columns,
            drive,
            LoadParameters { allowable_stress_mpa: allowable, ..johnson },
            "",
        ),
        row("balls", Columns, balls, hertz, "40"),
        row("balls, gaps", Columns, balls, with_gaps(hertz), ""),
        row("flat-sided teeth, `linear`", Columns, flats, by_work, ""),
        row("flat-sided teeth, `palmgren`", Columns, flats, palmgren, ""),
        row("flat-sided teeth, `johnson`", Columns, flats, johnson, ""),
        row("`linear`, tip relief", Columns, drive, relieved(by_work), "25"),
        row("`johnson`, tip relief", Columns, drive, relieved(johnson), "70"),
        row("`linear`, deviating slots", Columns, drive, by_work, "25").with_slots_that_deviate(),
        row("`palmgren`, deviating slots", Columns, drive, palmgren, "70").with_slots_that_deviate(),
        row("`johnson`, deviating slots", Columns, drive, johnson, "70").with_slots_that_deviate(),
        row("balls, deviating slots", Columns, balls, hertz, "").with_slots_that_deviate(),
        row("`johnson`, unlike zones", Columns, unlike, johnson, ""),
        row("`linear`, no column kept", Unkept, drive, load, ""),
        row("`palmgren`, no column kept", Unkept, drive, palmgren, ""),
        row("`linear`, gaps, no column kept", Unkept, drive, with_gaps(by_work), ""),
        row("`palmgren`, gaps, no column kept", Unkept, drive, with_gaps(palmgren), ""),
        row("`johnson`, no column kept", Unkept, drive, johnson, ""),
        row("`johnson`, gaps, no column kept", Unkept, drive, with_gaps(johnson), ""),
        row("balls, no column kept", Unkept, balls, hertz, ""),
        row("eccentric circle, `linear`", Columns, eccentric, load, "`linear` + 3"),
        row("harmonic support of two lobes, `linear`", Columns, harmonic, load, "`linear` + 6"),
        row("harmonic path of two lobes, `linear`", Columns, path, load, "`linear` + 3"),
        row("peaks of 16 intervals, 5.1 `linear`", Peaks, drive, load, "2.5"),
        row("peaks of 16 intervals, 5.1 `johnson`", Peaks, drive, johnson, "8"),
        row("peaks of 16 intervals, 5.2 `johnson`", Peaks, PAPER_5_2, johnson, "10"),
        row("peaks of 16 intervals, 5.1 balls", Peaks, balls, hertz, ""),
        row("true peaks to 1e-9, 5.1 `linear`", TruePeaks, drive, load, "30"),
        row("true peaks to 1e-9, 5.1 `johnson`", TruePeaks, drive, johnson, "30"),
        row("true peaks to 1e-9, 5.1 balls", TruePeaks, balls, hertz, ""),
        row("true peaks to 1e-9, 5.2 `linear`", TruePeaks, PAPER_5_2, load, "30"),
        row("true peaks to 1e-9, undercut threshold", TruePeaks, undercut(drive), load, "30"),
        row("refusal where teeth touch", Refusal, DriveParameters { tooth_radius_mm: 8.0, ..drive }, load, "3"),
    ]
}

/// Runs a row once, the way of now or the plain path; the number of states it is to be counted by.
fn run(row: &Row, is_plain: bool) -> Result<f64, Failure> {
    let row = black_box(row);
    if let Question::Refusal = row.question {
        return match Drive::new(&row.drive) {
            Err(DriveError::Impossible(violations)) => Ok(if black_box(violations).is_empty() { 0.0 } else { 1.0 }),
            _ => Err("the drive is not refused".into()),
        };
    }
    let drive = Drive::new(&row.drive)?;
    let load = LoadCase::new(&row.load).map_err(|violations| format!("{violations:?}"))?;
    let points = match row.question {
        Question::Columns => Points::samples(5000 / row.deviations.mesh(&drive).load_periods()),
        Question::Unkept => Points::samples(5000),
        Question::Peaks | Question::Refusal => Points::samples(16),
        Question::TruePeaks => Points::tolerance(1e-9, 10_000_000),
    };
    let points = points.map_err(|violation| violation.to_string())?;
    match row.question {
        Question::Columns => {
            let way = if is_plain { sweep_plain_with_deviations } else { sweep_with_deviations };
            Ok(black_box(way(&drive, &load, &row.deviations, points, &Never)?).states.len() as f64)
        }
        Question::TruePeaks | Question::Peaks | Question::Refusal | Question::Unkept => {
            if is_plain {
                black_box(sweep_plain(&drive, &load, points, &Never)?);
            } else {
                black_box(peaks(&drive, &load, points, &Never)?);
            }
            Ok(match points {
                Points::Samples(samples) => Mesh::new(&drive).state_count(samples) as f64,
                Points::Tolerance(_) => 1.0,
            })
        }
    }
}

/// What the table is, and what stands in the way where a goal is missed.
const INTRODUCTION: &str = "\n## Every model\n\n\
    Case 5.1 unless another one is named; *before* is the plain path, state by state, which all of them but the first took, measured in \
    the same run. Times are those on the processor, which what else runs counts in only as far as it shares the core. Sweeps are of 5000 intervals, from the \
    parameters to all columns, in ns a state; the rest, from the parameters too, is in µs.\n\n\
    - On an ellipse a state takes five roots and three divisions beside that of its position. `palmgren` adds a root, a division and three roots of ninth and tenth order, each of some 35 operations; \
    balls add two logarithms, each with a division, four cube roots, and the sums for two quantities at wave generator and ring. Columns are 92 bytes of memory a state, which rows without them do not write.\n\
    - True peaks are looked for alike either way (docs/explanation/theory.md section 9); *before* works the moments out tooth by tooth, and the columns with them.\n\
    - Where slots deviate, the teeth of both zones are told apart over fourteen load periods; in each the positions are the same, and are worked out once.\n\n\
    | | unit | goal | before | now | times |\n|---|---|---|---|---|---|\n";

/// The table: goal, before and now, of each row whose name has these words.
pub(crate) fn table(effort: Effort, only: &str) -> Result<String, Failure> {
    let mut text = String::from(INTRODUCTION);
    for row in rows().iter().filter(|row| row.name.contains(only)) {
        let states = run(row, false)?;
        let mut contestants = vec![
            Contestant::of_processor("now", || run(row, false)),
            Contestant::of_processor("before", || run(row, true)),
        ];
        take_turns(&mut contestants, effort.choose(11, 3))?;
        let (unit, factor) = match row.question {
            Question::Columns | Question::Unkept => ("ns", 1e9 / states),
            Question::Peaks | Question::TruePeaks | Question::Refusal => ("µs", 1e6),
        };
        let [now, before] = [0, 1].map(|at| contestants[at].spread(factor));
        let ratio =
            Spread::of(contestants[0].seconds.iter().zip(&contestants[1].seconds).map(|(now, before)| before / now));
        let before = before.show(1.0);
        let line =
            format!("| {} | {unit} | {} | {before} | {} | {} |", row.name, row.goal, now.show(1.0), ratio.show(1.0));
        println!("{line}");
        writeln!(text, "{line}")?;
    }
    Ok(text)
}
